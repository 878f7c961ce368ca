# er3a: results are data; recordings and reports are views of it.
#
# `make run` calls this with config/config.yaml; another study: snakemake --configfile FILE.
from pathlib import Path

from snakemake.utils import min_version

min_version("9.10")


include: "workflow/rules/common.smk"
include: "workflow/rules/stages.smk"
include: "workflow/rules/views.smk"


rule all:
    default_target: True
    input:
        "reports/index.html",
        "reports/junit.xml",  # which a run that did not end well takes away
        [f"reports/{page}" for page in STUDY.article_pages().values()],
        [views_of(robot, asked_recordings(robot)) for robot in ROBOTS],
        # Named too, so that a result that was deleted is made again although its views are still there.
        [results_of(robot, stage) for robot in ROBOTS for stage in asked_stages(robot)],
    message:
        "all results, recordings and reports are there"


onerror:
    print(
        "\nWhat failed, in short:",
        *(
            told("error: ")
            or ["see the lines marked ✗ above, and the logs that they name; without any the run was stopped"]
        ),
        sep="\n",
    )


onsuccess:
    print(
        *told("note: "),
        *(f"The article, item by item: reports/{page}" for page in STUDY.article_pages().values()),
        f"\nOpen reports/index.html in a browser; `{view_command()}` opens the recordings.",
        sep="\n",
    )
