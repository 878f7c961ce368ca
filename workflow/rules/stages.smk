# The rule that computes a stage of a robot, for each stage in the registry; and one to ask for the stage by its name.


for stage in STAGES.values():

    rule:
        name:
            f"compute_{stage.name}"
        input:
            lambda wildcards, stage=stage.name: inputs(wildcards.robot, stage),
        output:
            results_of("{robot}", stage.name),
        log:
            f"logs/{{robot}}/{stage.name}.compute.log",
        priority: {"validation": 3, "workspace": 2, "programs": 1}.get(stage.name, 0)  # what takes longest starts first
        conda:
            "../envs/er3a.yaml"
        resources:
            **{f"compiles_{stage.name}": 1},
        params:
            stage=stage.name,
            settings=lambda wildcards, stage=stage.name: STUDY.computed_from(wildcards.robot, stage),
            # Snakemake sees a changed file only if it is newer, and no edit of an imported package.
            contents=lambda wildcards, stage=stage.name: STUDY.inputs_digest(wildcards.robot, stage),
            code=numbers_digest(),
        message:
            f"{{wildcards.robot}}: compute {stage.name}"
        shell:
            f"{ER3A} compute {{params.stage}} {{wildcards.robot}} 2> {{log}}"

    rule:
        name:
            stage.name
        input:
            "reports/index.html",
            "reports/junit.xml",
            [path for robot in ROBOTS if stage.name in STUDY.stages(robot) for path in results_of(robot, stage.name)],
        message:
            f"all of the stage {stage.name} is there"
