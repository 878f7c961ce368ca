# The rules that compute the stages of a robot, and a rule to ask for each stage in the registry by its name.


for robot in ROBOTS:
    for job, stages in jobs_of(robot).items():
        asked = [stage for stage in stages if stage in ASKED]
        if asked:

            rule:
                name:
                    f"compute_{robot}_{job}"
                input:
                    list(dict.fromkeys(path for stage in stages for path in inputs(robot, stage))),
                output:
                    [update(path) for stage in asked for path in results_of(robot, stage)],
                log:
                    f"logs/{robot}/{job}.compute.log",
                # Most robots have no more than a model's job; the first one's has a page to read.
                priority: 3 if shown_early(robot, asked) else 2 if job == "model" else 1
                conda:
                    "../envs/er3a.yaml"
                resources:
                    **{f"compiles_{stage}": 1 for stage in asked},
                    # No parameter: results do not become others because fewer are asked for.
                    asked=asked_of(asked),
                    shown=shown_early(robot, asked),
                params:
                    robot=robot,
                    settings={stage: STUDY.computed_from(robot, stage) for stage in stages},
                    # Snakemake sees a changed file only if it is newer, and no edit of an imported package.
                    contents=[STUDY.inputs_digest(robot, stage) for stage in stages],
                    code=numbers_digest(),
                message:
                    f"{robot}: compute {', '.join(asked)}"
                shell:
                    f"{ER3A} compute {{resources.asked}} {{params.robot}} {{resources.shown}} 2> {{log}}"


for stage in STAGES.values():

    rule:
        name:
            stage.name
        input:
            "reports/index.html",
            "reports/junit.xml",
            [path for robot in ROBOTS if stage.name in STUDY.stages(robot) for path in results_of(robot, stage.name)],
        message:
            f"all of the stage {stage.name} is there"
