rule compute_trajectory:
    input:
        inputs("trajectory"),
    output:
        summary="results/{robot}/trajectory/summary.json",
        tables=tables("trajectory"),
    log:
        "logs/{robot}/trajectory.compute.log",
    benchmark:
        "logs/{robot}/trajectory.compute.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        settings=settings("trajectory"),
        code=code_of("trajectory", "compute"),
    message:
        "{wildcards.robot}: compute trajectory"
    shell:
        "er3a compute trajectory {wildcards.robot} 2> {log}"
