import hashlib
import os
import shlex
import sys
import time
from pathlib import Path

from er3a.pipeline.code_digest import code_digest, numbers_digest
from er3a.errors import Er3aError
from er3a.files.kept_files import from_here, view_command
from er3a.files.units import noted_doubts
from er3a.pipeline.commands.options import print_warning
from er3a.pipeline import language
from er3a.pipeline.language import catalogue_file
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study

DEFAULT_STUDY = "config/config.yaml"
STARTED = time.time()

# A study is one file as a whole: several would be merged key by key, and single values set on the command line would
# reach the rules but not the stages, which read the file.
if len(workflow.overwrite_configfiles) > 1 or workflow.config_settings.config:
    raise WorkflowError("er3a takes one study file (--configfile FILE) and no --config; edit the file instead.")

STUDY_FILE = str(next(iter(workflow.overwrite_configfiles), DEFAULT_STUDY))

try:
    with noted_doubts() as doubts:
        STUDY = load_study(STUDY_FILE)
except Er3aError as error:
    raise WorkflowError(str(error)) from None
for doubt in doubts if "ER3A_STAGES" not in os.environ else ():  # `er3a run` has told of them
    print_warning(doubt, type(doubt))

ROBOTS = STUDY.names

# The stages that a run is asked for: all, or those that `er3a run` was given and what their pages rest on.
ASKED = os.environ.get("ER3A_STAGES", "").split() or list(STAGES)

# Pages depend on the words of their language, results and recordings don't.
LANGUAGE = STUDY.report.language
language.use(LANGUAGE, STUDY.own_titles())


def catalogues(code):
    """The catalogues that pages in a language show: of our words, and of people's texts beside their files."""
    own = [] if code == "en" else (catalogue_file(code), *STUDY.own_catalogues(code))
    return [from_here(file) for file in own]


CATALOGUES = catalogues(LANGUAGE)


wildcard_constraints:
    robot="|".join(ROBOTS),


def _for_shell(path):
    """A path as one word of a shell command, in which Snakemake finds nothing to fill in."""
    return shlex.quote(str(path)).replace("{", "{{").replace("}", "}}")


# Jobs find the commands of the environment that Snakemake runs in, read the same study, and use one thread each:
# the pipeline runs jobs side by side instead. A shell of Windows takes the settings from this process.
SINGLE = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), "1") | {"PYTHONHASHSEED": "0"}
if os.name == "nt":
    os.environ |= SINGLE | {"ER3A_STUDY": STUDY_FILE}
    ER3A = f'"{sys.executable}" -P -m er3a'.replace("{", "{{").replace("}", "}}")
else:
    settings = " ".join(f"{name}={value}" for name, value in SINGLE.items())
    shell.prefix(
        f"export PATH={_for_shell(Path(sys.executable).parent)}:$PATH ER3A_STUDY={_for_shell(STUDY_FILE)} {settings}; "
    )
    ER3A = "exec er3a"


def asked_of(stages):
    """The words that ask a job for stages: it leaves alone those whose results are as they would be, but not where a run
    is to make all anew, which Snakemake says only when it has read all rules."""

    def words(wildcards):
        forced = workflow.dag_settings
        anew = forced and (forced.forceall or forced.forcerun or forced.forcetargets)
        return ",".join(stages) + ("" if anew else " --changed")

    return words


def told(start):
    """The lines with this start that jobs of this run have told, each once."""
    logs = [path for path in Path("logs").rglob("*.log") if path.stat().st_mtime >= STARTED - 1]
    lines = [line for path in sorted(logs) for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    return list(dict.fromkeys(line for line in lines if line.startswith(start)))


def inputs(robot, stage):
    """The files that a stage, or the teach panel, reads for a robot."""
    return [from_here(path) for path in STUDY.inputs(robot, stage)]


def results_of(robot, stage):
    """Paths of a stage's results: the list of checksums stands for its tables."""
    return [f"results/{robot}/{stage}/{name}" for name in ("summary.json", "SHA256SUMS")]


OF_MODEL = ("validation", "workspace")  # together they take as long as all others together


def jobs_of(robot):
    """The stages of a robot by the name of the job that computes them: two that take about as long, as a process takes
    two seconds to start."""
    stages = STUDY.stages(robot)
    jobs = {"model": [stage for stage in stages if stage in OF_MODEL]}
    jobs["others"] = [stage for stage in stages if stage not in OF_MODEL]
    return jobs


def asked_stages(robot):
    """The stages of a robot that the run is asked for."""
    return [stage for stage in STUDY.stages(robot) if stage in ASKED]


def asked_pages(robot):
    """The pages of a robot that the run is asked for; the teach panel belongs to the validation."""
    return [page for page in STUDY.pages(robot) if ("validation" if page == "teach" else page) in ASKED]


def asked_recordings(robot):
    """The stages of a robot whose recordings the run is asked for."""
    return [stage for stage in asked_stages(robot) if "record" in STAGES[stage].views]


def shown_early(robot, stages):
    """The words by which the job of a first run's first robot writes a page before it goes on: one that shows no other
    results."""
    first = next((name for name in ROBOTS if not STUDY.other_tables(name)), None)
    early = robot == first and "validation" in stages and not Path("reports/index.html").exists()
    return "--show validation" if early else ""


def views_of(robot, stages):
    """Paths of recordings with their pictures."""
    return [f"reports/{robot}/{stage}.{kind}" for stage in stages for kind in ("rrd", "webp")]


def rested_on():
    """Digest of what all results rest on, which the index compares with what it is now."""
    all_of = [(robot, stage) for robot in ROBOTS for stage in STUDY.stages(robot)]
    now = [(*of, STUDY.inputs_digest(*of), STUDY.computed_from(*of), numbers_digest()) for of in all_of]
    return hashlib.sha256(repr(now).encode()).hexdigest()


def shown_by(robot):
    """The results that the pages of a robot show: its own, and of tables to use instead verdicts and reach."""
    tables = STUDY.other_tables(robot) if "validation" in asked_stages(robot) else []
    return [
        *(path for stage in asked_stages(robot) for path in results_of(robot, stage)),
        *(f"results/{other}/validation/summary.json" for other in tables),
        *(
            path
            for other in tables
            if "workspace" in set(asked_stages(robot)) & set(asked_stages(other))
            for path in results_of(other, "workspace")
        ),
    ]
