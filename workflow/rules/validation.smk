rule compute_validation:
    input:
        inputs("validation"),
    output:
        summary="results/{robot}/validation/summary.json",
        tables=tables("validation"),
    log:
        "logs/{robot}/validation.compute.log",
    benchmark:
        "logs/{robot}/validation.compute.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        settings=settings("validation"),
        code=code_of("validation", "compute"),
    message:
        "{wildcards.robot}: compute validation"
    shell:
        "er3a compute validation {wildcards.robot} 2> {log}"
