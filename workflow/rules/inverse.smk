rule compute_inverse:
    input:
        inputs("inverse"),
    output:
        summary="results/{robot}/inverse/summary.json",
        tables=tables("inverse"),
    log:
        "logs/{robot}/inverse.compute.log",
    benchmark:
        "logs/{robot}/inverse.compute.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        settings=settings("inverse"),
        code=code_of("inverse", "compute"),
    message:
        "{wildcards.robot}: compute inverse"
    shell:
        "er3a compute inverse {wildcards.robot} 2> {log}"
