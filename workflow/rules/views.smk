rule record:
    input:
        viewed,
    output:
        recording="reports/{robot}/{stage}.rrd",
        picture="reports/{robot}/{stage}.webp",
    log:
        "logs/{robot}/{stage}.record.log",
    priority: 4
    conda:
        "../envs/er3a.yaml"
    params:
        code=lambda wildcards: code_of(wildcards.stage, "record"),
        drawing=code_digest("er3a.pipeline.viewing.viewer"),
    message:
        "{wildcards.robot}: record {wildcards.stage}"
    shell:
        "er3a record {wildcards.stage} {wildcards.robot} 2> {log}"


rule report:
    input:
        viewed,
        rests_on,
        CATALOGUES,
        picture,
    output:
        report(
            "reports/{robot}/{stage}.html",
            caption="../report/stage.rst",
            category="{robot}",
            labels=lambda wildcards: {tr(pages.PAGE): tr(STAGES[wildcards.stage].title)},
        ),
    log:
        "logs/{robot}/{stage}.report.log",
    priority: 4  # pages to read while the rest is computed
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        caption=lambda wildcards: pages.of_stage(titled(wildcards.robot), STAGES[wildcards.stage].question),
        code=lambda wildcards: code_of(wildcards.stage, "report"),
    message:
        "{wildcards.robot}: report {wildcards.stage}"
    shell:
        "er3a report {wildcards.stage} {wildcards.robot} 2> {log}"


rule teach:
    input:
        inputs("teach"),
        "results/{robot}/validation/summary.json",
        CATALOGUES,
    output:
        report(
            "reports/{robot}/teach.html",
            caption="../report/teach.rst",
            category="{robot}",
            labels={tr(pages.PAGE): tr(pages.TEACH_PANEL)},
        ),
    log:
        "logs/{robot}/teach.log",
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        caption=lambda wildcards: pages.of_teach_panel(titled(wildcards.robot)),
        settings=settings("trajectory"),
        contents=contents("teach"),
        code=code_digest("er3a.pipeline.teach.panel"),
    message:
        "{wildcards.robot}: write the teach panel"
    shell:
        "er3a teach {wildcards.robot} 2> {log}"


rule index:
    input:
        shown_in_index,
        CATALOGUES,
    output:
        report(
            "reports/index.html",
            caption="../report/index.rst",
            category=tr(pages.ALL_ROBOTS),
            labels={tr(pages.PAGE): tr(pages.INDEX)},
        ),
        report(
            "reports/compare.html",
            caption="../report/compare.rst",
            category=tr(pages.ALL_ROBOTS),
            labels={tr(pages.PAGE): tr(pages.COMPARISON)},
        ),
        "reports/junit.xml",
    log:
        "logs/index.log",
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        captions=[pages.of_index(), pages.of_comparison()],
        expected={name: STUDY.entry(name).expect for name in STUDY.robots},
        rested_on=rested_on,
        code=code_digest("er3a.pipeline.viewing.index", *all_messages()),
    message:
        "write the index"
    shell:
        "er3a index 2> {log}"


if STUDY.article:

    rule article:
        input:
            [
                path.format(robot=robot)
                for robot in STUDY.article.names
                for stage in STUDY.stages(robot)
                for path in results_of(stage)
            ],
            [os.path.relpath(STUDY.robot_file(robot)) for robot in STUDY.article.names],
            [catalogues(code) for code in language.LANGUAGES],
        output:
            "results/article.json",
            report(
                [f"reports/{page}" for page in STUDY.article_pages().values()],
                caption="../report/article.rst",
                category=tr(pages.ALL_ROBOTS),
                labels={tr(pages.PAGE): tr(pages.ARTICLE)},
            ),
        log:
            "logs/article.log",
        conda:
            "../envs/er3a.yaml"
        params:
            tables=STUDY.article.model_dump(),
            language=LANGUAGE,
            caption=pages.of_article(),
            code=code_digest("er3a.pipeline.article.article_page", "er3a.pipeline.messages.article", *all_messages()),
        message:
            "write the page on the article"
        shell:
            "er3a article 2> {log}"
