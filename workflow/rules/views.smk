# The pages and recordings of a robot are made by one job: each would take longer to start than to work.


for robot in ROBOTS:

    rule:
        name:
            f"views_{robot}"
        input:
            shown_by(robot),
            [inputs(robot, "teach") if "teach" in asked_pages(robot) else []],
            CATALOGUES,
        output:
            views_of(robot, asked_recordings(robot)),
            *[
                report(
                    f"reports/{robot}/{page}.html",
                    category=robot,
                    labels={"page": page},
                )
                for page in asked_pages(robot)
            ],
        log:
            f"logs/{robot}/views.log",
        priority: 4  # pages to read while the rest is computed
        conda:
            "../envs/er3a.yaml"
        params:
            robot=robot,
            pages=asked_pages(robot),
            language=LANGUAGE,
            settings=STUDY.settings(robot, "trajectory"),
            contents=STUDY.inputs_digest(robot, "teach"),
            code=code_digest(),
        message:
            f"{robot}: write pages and recordings"
        shell:
            f"{ER3A} views {{params.robot}} {{params.pages}} 2> {{log}}"


rule index:
    input:
        [path for robot in ROBOTS for stage in asked_stages(robot) for path in results_of(robot, stage)],
        [f"reports/{robot}/{page}.html" for robot in ROBOTS for page in asked_pages(robot)],
        CATALOGUES,
    output:
        report(
            "reports/index.html",
            labels={"page": "index"},
        ),
        "reports/junit.xml",
    log:
        "logs/index.log",
    conda:
        "../envs/er3a.yaml"
    params:
        language=LANGUAGE,
        expected={name: STUDY.entry(name).expect for name in STUDY.robots},
        rested_on=rested_on(),
        code=code_digest(),
    message:
        "write the index"
    shell:
        f"{ER3A} index 2> {{log}}"


if STUDY.article:

    rule article:
        input:
            [
                path
                for robot in STUDY.article.names
                for stage in STUDY.stages(robot)
                for path in results_of(robot, stage)
            ],
            [os.path.relpath(STUDY.robot_file(robot)) for robot in STUDY.article.names],
            [catalogues(code) for code in language.LANGUAGES],
        output:
            "results/article.json",
            report(
                [f"reports/{page}" for page in STUDY.article_pages().values()],
                labels={"page": "article"},
            ),
        log:
            "logs/article.log",
        conda:
            "../envs/er3a.yaml"
        params:
            tables=STUDY.article.model_dump(),
            language=LANGUAGE,
            code=code_digest(),
        message:
            "write the page on the article"
        shell:
            f"{ER3A} article 2> {{log}}"
