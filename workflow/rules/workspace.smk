# The seeded blocks are fixed by the study; scattering only groups them into jobs (--set-scatter blocks=N).
scattergather:
    blocks=STUDY.workspace.parts,


rule sample_workspace:
    input:
        inputs("workspace"),
    output:
        temp("results/{robot}/workspace/parts/{scatteritem}.npz"),
    log:
        "logs/{robot}/workspace.sample.{scatteritem}.log",
    benchmark:
        "logs/{robot}/workspace.sample.{scatteritem}.tsv"
    priority: 2  # what takes longest starts first
    conda:
        "../envs/er3a.yaml"
    params:
        settings=settings("workspace"),
        code=code_of("workspace", "sample"),
    message:
        "{wildcards.robot}: sample the workspace, part {wildcards.scatteritem}"
    shell:
        "er3a sample {wildcards.robot} --part {wildcards.scatteritem} --output {output} 2> {log}"


rule compute_workspace:
    input:
        files=inputs("workspace"),
        parts=gather.blocks("results/{{robot}}/workspace/parts/{scatteritem}.npz"),
    output:
        summary="results/{robot}/workspace/summary.json",
        tables=tables("workspace"),
    log:
        "logs/{robot}/workspace.compute.log",
    benchmark:
        "logs/{robot}/workspace.compute.tsv"
    priority: 1
    conda:
        "../envs/er3a.yaml"
    params:
        settings=settings("workspace"),
        capability=settings("capability"),
        code=code_of("workspace", "compute"),
    message:
        "{wildcards.robot}: compute workspace"
    shell:
        "er3a compute workspace {wildcards.robot} {input.parts} 2> {log}"
