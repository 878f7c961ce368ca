import hashlib
import os
import shlex
import sys
import time
import warnings

from snakemake.dag import PeriodicityDetector

from er3a.pipeline.code_digest import code_digest
from er3a.errors import Er3aError, InputWarning
from er3a.files.kept_files import view_command
from er3a.pipeline.commands.options import print_warning
from er3a.pipeline.messages import language, pages
from er3a.pipeline.messages.language import catalogue_file, tr
from er3a.pipeline.stages.registry import STAGES, all_messages
from er3a.pipeline.study import load_study

DEFAULT_STUDY = "config/config.yaml"
STARTED = time.time()

# A study is one file as a whole: several would be merged key by key, and single values set on the command line would
# reach the rules but not the stages, which read the file.
if len(workflow.overwrite_configfiles) > 1 or workflow.config_settings.config:
    raise WorkflowError("er3a takes one study file (--configfile FILE) and no --config; edit the file instead.")

STUDY_FILE = str(next(iter(workflow.overwrite_configfiles), DEFAULT_STUDY))

# Where `er3a run` reads this in its own process, it has told of doubtful numbers; otherwise they are told as it does.
IS_TOLD = warnings.showwarning is print_warning
warnings.showwarning = print_warning

try:
    with warnings.catch_warnings():
        if IS_TOLD:
            warnings.simplefilter("ignore", InputWarning)
        STUDY = load_study(STUDY_FILE)
except Er3aError as error:
    raise WorkflowError(str(error)) from None

ROBOTS = STUDY.names

# Pages depend on the words of their language, results and recordings don't.
LANGUAGE = STUDY.report.language
language.use(LANGUAGE, STUDY.own_titles())


def catalogues(code):
    """The catalogues that pages in a language show: of our words, and of people's texts beside their files."""
    own = [] if code == "en" else (catalogue_file(code), *STUDY.own_catalogues(code))
    return [os.path.relpath(file) for file in own]


CATALOGUES = catalogues(LANGUAGE)


# Snakemake's own report: its text, and what it calls pages and robots. The text of its first page has no params.
config["description"] = pages.of_study()


def titled(robot):
    """A robot's title in the language of the pages."""
    return language.own_title(STUDY.robot(robot).title)


# Snakemake takes a name that repeats one part twenty times for a rule that feeds itself for ever. Robots and stages are
# lists of names here, in which nothing grows.
PeriodicityDetector.is_periodic = lambda self, value: None


wildcard_constraints:
    robot="|".join(ROBOTS),
    stage="|".join(STAGES),


def _for_shell(path):
    """A path as one word of a shell command, in which Snakemake finds nothing to fill in."""
    return shlex.quote(str(path)).replace("{", "{{").replace("}", "}}")


# Jobs find the commands of the environment that Snakemake runs in, read the same study, and use one thread each:
# the pipeline runs jobs side by side instead.
shell.prefix(
    f"export PATH={_for_shell(Path(sys.executable).parent)}:$PATH ER3A_STUDY={_for_shell(STUDY_FILE)} "
    "OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 PYTHONHASHSEED=0; "
)


def told(start):
    """The lines with this start that jobs of this run have told, each once."""
    logs = [path for path in Path("logs").rglob("*.log") if path.stat().st_mtime >= STARTED - 1]
    lines = [line for path in sorted(logs) for line in path.read_text(errors="replace").splitlines()]
    return list(dict.fromkeys(line for line in lines if line.startswith(start)))


def tables(stage):
    """Paths of a stage's tables and their checksums, the robot as wildcard."""
    folder = f"results/{{robot}}/{stage}"
    return [*(f"{folder}/{table}.parquet" for table in STAGES[stage].tables), f"{folder}/SHA256SUMS"]


def inputs(stage):
    """Input function: the files that a stage reads for a robot."""
    return lambda wildcards: [os.path.relpath(path) for path in STUDY.inputs(wildcards.robot, stage)]


def settings(key):
    """Params function: what of one key of the study concerns a robot, so that only its change makes jobs run again."""
    return lambda wildcards: STUDY.settings(wildcards.robot, key)


def computed_from(stage):
    """Params function: the parts of the study that a stage's numbers depend on."""
    return lambda wildcards: STUDY.computed_from(wildcards.robot, stage)


def contents(stage):
    """Params function: digest of the files that a stage reads: Snakemake sees a changed file only if it is newer."""
    return lambda wildcards: STUDY.inputs_digest(wildcards.robot, stage)


def rested_on(wildcards):
    """Params function: digest of what all results rest on, which the index compares with what it is now."""
    all_of = [(robot, stage) for robot in ROBOTS for stage in STUDY.stages(robot)]
    now = [(*of, STUDY.inputs_digest(*of), STUDY.computed_from(*of), code_of(of[1], "compute")) for of in all_of]
    return hashlib.sha256(repr(now).encode()).hexdigest()


def code_of(stage, verb):
    """Digest of the modules that a verb of a stage uses: Snakemake doesn't see edits of an imported package."""
    return STAGES[stage].digest(verb)


def results_of(stage):
    """Paths of a stage's results, the robot as wildcard."""
    return [f"results/{{robot}}/{stage}/summary.json", *tables(stage)]


def of_all(path, view=None):
    """A path with the wildcards robot and stage, for all stages of all robots, or those that have a view."""
    return [
        path.format(robot=robot, stage=stage)
        for robot in ROBOTS
        for stage in STUDY.stages(robot)
        if view is None or view in STAGES[stage].views
    ]


def is_asked(robot, stage):
    """Whether the index waits for a stage of a robot: all, or those that are named and what their pages rest on.

    Of others it shows what was computed before. A job that runs elsewhere finds what it shows in place.
    """
    named = set(workflow.dag_settings.targets or ())
    asked = set(STAGES)
    if named and named <= asked:
        asked = {name for stage in named for name in (stage, *STAGES[stage].rests_on)}
    if not workflow.is_main_process:
        return os.path.exists(f"results/{robot}/{stage}/summary.json")
    return stage in asked and stage in STUDY.stages(robot)


def shown_in_index(wildcards):
    """Input function: the results that the index waits for, and the pages that it links to."""
    asked = [(robot, stage) for robot in ROBOTS for stage in STUDY.stages(robot) if is_asked(robot, stage)]
    pages = [(robot, page) for robot in ROBOTS for page in STUDY.pages(robot)]
    return [
        *(f"results/{robot}/{stage}/summary.json" for robot, stage in asked),
        *(f"results/{robot}/workspace/border.parquet" for robot in STUDY.robots if is_asked(robot, "workspace")),
        *(
            f"reports/{robot}/{page}.html"
            for robot, page in pages
            if is_asked(robot, "validation" if page == "teach" else page)
        ),
    ]


def viewed(wildcards):
    """Input function: the results that a stage's views show."""
    return [path.format(robot=wildcards.robot) for path in results_of(wildcards.stage)]


def rests_on(wildcards):
    """Input function: the verdicts that a stage's page says first, and those on tables to use instead of the robot's.

    Of stages that it shows besides, the results, if the run makes them.
    """
    others = [stage for stage in STAGES[wildcards.stage].rests_on if stage in STUDY.stages(wildcards.robot)]
    others += [stage for stage in STAGES[wildcards.stage].shows if is_asked(wildcards.robot, stage)]
    tables = STUDY.other_tables(wildcards.robot) if wildcards.stage == "validation" else []
    return [
        *(f"results/{wildcards.robot}/{stage}/summary.json" for stage in others),
        *(f"results/{robot}/validation/summary.json" for robot in tables),
    ]


def picture(wildcards):
    """Input function: the picture of a stage's recording, if it has one."""
    return [f"reports/{wildcards.robot}/{wildcards.stage}.webp"] if "record" in STAGES[wildcards.stage].views else []
