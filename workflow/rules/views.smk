rule record:
    input:
        viewed,
    output:
        recording="reports/{robot}/{stage}.rrd",
        picture="reports/{robot}/{stage}.webp",
    log:
        "logs/{robot}/{stage}.record.log",
    benchmark:
        "logs/{robot}/{stage}.record.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        code=lambda wildcards: code_of(wildcards.stage, "record"),
        drawing=code_digest("er3a.pipeline.viewing.preview"),
    message:
        "{wildcards.robot}: record {wildcards.stage}"
    shell:
        "er3a record {wildcards.stage} {wildcards.robot} 2> {log}"


rule report:
    input:
        viewed,
        rests_on,
        CATALOGUE,
        picture,
    output:
        report(
            "reports/{robot}/{stage}.html",
            caption="../report/stage.rst",
            category="{robot}",
            labels={"page": "{stage}"},
        ),
    log:
        "logs/{robot}/{stage}.report.log",
    benchmark:
        "logs/{robot}/{stage}.report.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        code=lambda wildcards: code_of(wildcards.stage, "report"),
    message:
        "{wildcards.robot}: report {wildcards.stage}"
    shell:
        "er3a report {wildcards.stage} {wildcards.robot} 2> {log}"


rule teach:
    input:
        inputs("teach"),
        CATALOGUE,
    output:
        report(
            "reports/{robot}/teach.html",
            caption="../report/teach.rst",
            category="{robot}",
            labels={"page": "teach panel"},
        ),
    log:
        "logs/{robot}/teach.log",
    benchmark:
        "logs/{robot}/teach.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        settings=settings("trajectory"),
        code=code_digest("er3a.pipeline.teach.panel"),
    message:
        "{wildcards.robot}: write the teach panel"
    shell:
        "er3a teach {wildcards.robot} 2> {log}"


rule index:
    input:
        of_all("results/{robot}/{stage}/summary.json"),
        expand("results/{robot}/workspace/border.parquet", robot=STUDY.robots),
        [f"reports/{robot}/{page}.html" for robot in ROBOTS for page in STUDY.pages(robot)],
        CATALOGUE,
    output:
        report(
            "reports/index.html",
            caption="../report/index.rst",
            category="all robots",
            labels={"page": "index"},
        ),
        report(
            "reports/compare.html",
            caption="../report/compare.rst",
            category="all robots",
            labels={"page": "two robots side by side"},
        ),
        "reports/junit.xml",
    log:
        "logs/index.log",
    benchmark:
        "logs/index.tsv"
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        expected={name: STUDY.entry(name).expect for name in STUDY.robots},
        code=code_digest("er3a.pipeline.viewing.index", *all_messages()),
    message:
        "write the index"
    shell:
        "er3a index 2> {log}"
