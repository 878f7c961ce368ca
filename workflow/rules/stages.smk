# The rules of each stage in the registry: its jobs that sample, if it has some, and the one that computes.


# The seeded blocks are fixed by the study; scattering only groups them into jobs (--set-scatter blocks=N).
scattergather:
    blocks=STUDY.workspace.parts,


for stage in STAGES.values():
    if stage.sampled:

        rule:
            name:
                f"sample_{stage.name}"
            input:
                inputs(stage.name),
            output:
                temp(f"results/{{robot}}/{stage.name}/parts/{{scatteritem}}.npz"),
            log:
                f"logs/{{robot}}/{stage.name}.sample.{{scatteritem}}.log",
            benchmark:
                f"logs/{{robot}}/{stage.name}.sample.{{scatteritem}}.tsv"
            priority: 2  # what takes longest starts first
            conda:
                "../envs/er3a.yaml"
            params:
                settings=settings(stage.name),
                contents=contents(stage.name),
                code=code_digest(f"{stage.package}.sample"),
            message:
                f"{{wildcards.robot}}: sample the {stage.name}, part {{wildcards.scatteritem}}"
            shell:
                "er3a sample {wildcards.robot} --part {wildcards.scatteritem} --output {output} 2> {log}"

    rule:
        name:
            f"compute_{stage.name}"
        input:
            files=inputs(stage.name),
            parts=(
                gather.blocks(f"results/{{{{robot}}}}/{stage.name}/parts/{{scatteritem}}.npz") if stage.sampled else []
            ),
        output:
            results_of(stage.name),
        log:
            f"logs/{{robot}}/{stage.name}.compute.log",
        priority: 3 if stage.name == "validation" else int(stage.sampled)
        conda:
            "../envs/er3a.yaml"
        resources:
            **{f"compiles_{stage.name}": 1},
        params:
            stage=stage.name,
            settings=computed_from(stage.name),
            contents=contents(stage.name),
            code=code_of(stage.name, "compute"),
        message:
            f"{{wildcards.robot}}: compute {stage.name}"
        shell:
            "er3a compute {params.stage} {wildcards.robot} {input.parts} 2> {log}"

    rule:
        name:
            stage.name
        input:
            "reports/index.html",
            "reports/junit.xml",
            [
                path.format(robot=robot)
                for robot in ROBOTS
                if stage.name in STUDY.stages(robot)
                for path in (
                    *results_of(stage.name),
                    *(f"reports/{{robot}}/{stage.name}.rrd" for view in stage.views if view == "record"),
                )
            ],
        message:
            f"all of the stage {stage.name} is there"
