"""HTML pages: one self-contained file each, rendered from a stage's template on the shared base."""

from __future__ import annotations

import base64
import gzip
import platform
import re
import shlex
import subprocess
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup

from er3a.by_value import frozen
from er3a.errors import ResultError
from er3a.files.kept_files import INSTALLED, ROOT, from_here, view_command, write_text
from er3a.pipeline import language
from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages.numbers import (
    at_least,
    at_most,
    fixed,
    measured,
    number,
)
from er3a.pipeline.messages.pages import GRADE_NAMES, GROUP_NAMES, Caveat, caveat, glossary
from er3a.pipeline.messages.say import bracketed, joined, listed, say, word
from er3a.pipeline.messages.scope import assumed_text, check_name, covered_text, gap_text, never_text, why_not_all
from er3a.pipeline.results import (
    AbsentResults,
    Provenance,
    Status,
    Stored,
    read_status,
    withheld,
)
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer
from er3a.pipeline.viewing.conditions import condition_of
from er3a.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HERE = Path(__file__).parent
SHOWN_VERSIONS = ("numpy", "scipy", "numba", "open3d-cpu", "rerun-sdk", "matplotlib")
VERDICT_WORDS = {
    "pass": N_("pass"),
    "caution": N_("caution"),
    "fail": N_("fail"),
    "conflict": N_("conflict"),
}

UNSAID = ("round_trips", "units")  # of er3a itself and of files: a reader learns nothing from their passing
PAGES = {stage.name: stage.title for stage in STAGES.values()} | {"teach": N_("Teach panel")}
SCRIPT_WORDS = {
    "sort": N_("sort by this column"),
    "csv": N_("CSV"),
    "svg": N_("download"),
    "enlarge": N_("enlarge"),
    "close": N_("close"),
    "filter": N_("Filter rows by"),
    "find": N_("Find"),
    "none": N_("Nothing has all these words: try fewer, or others"),
    "colon": N_(": "),
    "bounds": N_("at least|at most|up to|about"),  # words before a number by which cells are sorted all the same
}


MARKS = {"figure": N_("Figure {number}"), "table": N_("Table {number}")}


@frozen
class Numbered:
    """What a figure or table is called on its page, and its address there."""

    id: str
    text: str


class Numbering:
    """Counts the figures and tables of a page in its order; their addresses are of their names, so that they stay when
    others come. A name that is taken is counted; without one the number is the address."""

    def __init__(self) -> None:
        self._counts = dict.fromkeys(MARKS, 0)
        self._named: Counter[str] = Counter()

    def __call__(self, kind: str, name: str = "") -> Numbered:
        self._counts[kind] += 1
        address = re.sub(r"[^\w.-]+", "-", f"{kind}-{name or self._counts[kind]}")
        self._named[address] += 1
        again = self._named[address]
        return Numbered(address if again == 1 else f"{address}-{again}", tr(MARKS[kind], number=self._counts[kind]))


@frozen
class Picture:
    """A figure for a page: the image, what it shows (for those who can't see it), and what to conclude from it.

    ``over_time`` are axes whose x axis is the time (s) of a motion that the page's player shows, with its name.
    """

    figure: Figure
    alt: str
    caption: str
    over_time: Sequence[tuple[Axes, str]] = ()

    @property
    def uri(self) -> str:
        """The image as a data address."""
        from er3a.pipeline.viewing.figures import svg_data_uri  # Matplotlib, which few pages need

        return svg_data_uri(self.figure)

    @property
    def panels(self) -> list[list[float | str]]:
        """Of a figure that was drawn: left, bottom, right and top of axes over time in parts of the image, the times at
        both sides, and the motion's name."""
        edges = ((*ax.get_position().extents, *ax.get_xlim()) for ax, _ in self.over_time)
        return [[*(round(float(value), 5) for value in own), name] for own, (_, name) in zip(edges, self.over_time)]

    @property
    def readings(self) -> list[dict[str, Any]]:
        """Of a figure that was drawn: what the pointer reads in it."""
        from er3a.pipeline.viewing.figures import readings

        return readings(self.figure)

    @property
    def photograph(self) -> bool:
        """Whether it shows what a camera saw, which a dark page must not invert."""
        return any(ax.images for ax in self.figure.axes)

    @property
    def inches(self) -> float:
        """The width that the figure's letters are meant for."""
        return float(self.figure.get_figwidth())


@frozen
class ShownFigure:
    """A key figure in the page's language; the unit of a part of a whole is the whole, in words.

    ``measure`` : the unit as results name it
    """

    name: str
    label: str
    value: float | int | None
    unit: str
    uncertainty: float | None
    measure: str

    @property
    def text(self) -> str:
        """The value with the digits that matter; one that is named a bound is rounded as a bound."""
        if isinstance(self.value, float) and self.name.endswith(("_lower", "_upper")):
            return (at_least if self.name.endswith("_lower") else at_most)(self.value, self.measure)
        return measured(self.value, self.uncertainty, self.measure)


@frozen
class Head:
    """What frames a stage's page: its verdict as a sentence, key figures, and where the numbers come from.

    ``summary`` is the stage's, with the finding that the sentence says; ``caveat``: what to know
    first of the table that it rests on.
    ``checked``: each check, how much it covers, and why not all. ``assumed``: without a document.
    ``condition``: what of the table has to be confirmed, ``unconfirmed`` entries; empty where that is not known.
    """

    robot: str
    stage: str
    status: Status
    text: str
    figures: tuple[ShownFigure, ...]
    provenance: Provenance
    caveat: Caveat | None
    summary: Any
    checked: tuple[tuple[str, str, str], ...] = ()
    assumed: tuple[str, ...] = ()
    condition: str = ""
    unconfirmed: int = 0

    @property
    def table(self) -> str:
        """What to know first of the table that all rests on; empty where that is nothing."""
        return self.caveat.status if self.caveat else ""

    @property
    def no_verdict(self) -> bool:
        """Whether evidence contradicts the table that all rests on, so that nothing is said of the robot."""
        return withheld(self.status, self.table)

    @property
    def sign(self) -> str:
        """The class of its mark, the same on every page: a pass that rests on a table of which documents settle nothing
        is a caution."""
        if self.no_verdict:
            return "no_verdict"
        if self.status != "pass":  # a table about which documents disagree is worse than one of which part is open
            return "conflict" if self.status == "caution" and getattr(self.summary, "conflicts", None) else self.status
        return "caution" if self.table == "unsettled" else "pass"

    @property
    def finding(self) -> Any:
        """What the verdict says."""
        return self.summary.verdict.finding

    @property
    def gaps(self) -> list[str]:
        """Why checks that the verdict needs don't cover all."""
        return [gap_text(gap) for each in self.summary.verdict.missed for gap in each.gaps]


def head_of(stored: Stored[Any]) -> Head:
    """The head of a stage's page.

    Returns
    -------
    head : verdict and key figures in the page's language
    """
    summary, stage = stored.results.summary, stored.stage
    verdict = summary.verdict
    words = import_module(STAGES[stage].messages).KEY_FIGURES
    shown = tuple(
        ShownFigure(
            figure.name,
            language.translated(f"{stage}.figure", words[figure.name]),
            figure.value,
            tr("of {total}", total=figure.of) if figure.of is not None else language.unit_sign(figure.unit),
            figure.uncertainty,
            figure.unit,
        )
        for figure in summary.figures
    )
    found = say(verdict.finding)
    text = joined([found, *listed(verdict.findings[1:])], " ")
    checked = tuple(
        (
            check_name(each.check),
            covered_text(each),
            "" if each.complete else why_not_all(each, None),
        )
        for each in summary.checked
        if each.check not in UNSAID or each.gaps
    )
    return Head(
        stored.robot,
        stage,
        verdict.status,
        text,
        shown,
        stored.provenance,
        caveat(stored.table or ""),
        summary,
        checked,
        tuple(map(assumed_text, summary.assumed)),
        *condition_of(stored.validated),
    )


def render(
    template: Path,
    output: Path,
    summary: Any = None,
    *,
    head: Head | None = None,
    command: str | None,
    provenance: Provenance | None = None,
    **context: Any,
) -> None:
    """Render a template to ``output``, whole or not at all.

    Parameters
    ----------
    template : a Jinja file that extends ``base.html.j2``
    summary : the stage's summary, for the template
    head : what frames a stage's page
    command : the command that makes the page again, if there is one
    provenance : of pages that show no stage
    context : what the template needs besides
    """
    html = (
        page_environment(template.parent)
        .get_template(template.name)
        .render(
            style=(_HERE / "style.css").read_text(encoding="utf-8"),
            script=(_HERE / "page.js").read_text(encoding="utf-8"),
            script_words={key: tr(word) for key, word in SCRIPT_WORDS.items()},
            terms=glossary(),
            verdict_words=VERDICT_WORDS,
            at_side=bool(context.pop("at_side", False)),
            language=language.current(),
            summary=summary,
            head=head,
            command=command,
            provenance=head.provenance if head else provenance,
            preview=None if context.get("player") else _preview(output.with_suffix(".webp")),
            versions=_versions(),
            commit=_commit(),
            **context,
        )
    )
    write_text(output, closed_up(html) if language.current() == "zh" else html)


class _Compiled(dict[str, bytes]):
    """Templates that this process has compiled, by what jinja calls them: each page has an environment of its own, but
    most of it is what all pages share."""

    set = dict.__setitem__


_COMPILED = _Compiled()


def page_environment(*folders: Path) -> jinja2.Environment:
    """Jinja as pages use it.

    Parameters
    ----------
    folders : of templates, searched before those that all pages share

    Returns
    -------
    environment : undefined names are errors, texts are escaped, and figures are counted anew
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*folders, _HERE]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        extensions=["jinja2.ext.i18n"],
        # By language: what a filter makes of a constant is compiled in.
        bytecode_cache=jinja2.MemcachedBytecodeCache(_COMPILED, prefix=language.current()),  # type: ignore[arg-type]
    )
    environment.install_gettext_translations(language.translations(), newstyle=False)  # type: ignore[attr-defined]
    environment.policies["ext.i18n.trimmed"] = True
    environment.policies["json.dumps_kwargs"] = {"sort_keys": True, "ensure_ascii": False}  # `closed_up` reads texts
    environment.globals |= {
        "view_command": view_command,
        "numbered": Numbering(),
        "bracketed": bracketed,
        "pages": PAGES,
    }
    environment.filters |= {
        "number": number,
        "measured": measured,
        "fixed": fixed,
        "at_least": at_least,
        "at_most": at_most,
        "tr": tr,
        "own": language.own_title,
        "sentence": whole_sentence,
        "first_sentence": language.first_sentence,
        "breakable": breakable,
        "grade": partial(word, "grade", GRADE_NAMES),
        "group": partial(word, "group", GROUP_NAMES),
    }
    return environment


def render_stage(
    study: Study,
    stored: Stored[Any],
    output: Path,
    answer: Answer,
    **context: Any,
) -> None:
    """Render the page of a stage of a robot, from the template next to its ``report.py``.

    Parameters
    ----------
    study : that the results are of; the command at the page's foot names its file
    stored : what the stage found of a robot
    output : replaced whole, or left as it is
    answer : its first screen; that not all was checked follows it where the verdict is no pass because of that. Where
        evidence contradicts the table that all rests on it is shown only without a headline: it then says what is wrong
    context : what the template needs besides, by name
    """
    stage, framed = stored.stage, _framed(study, stored)
    head = framed["head"]
    if head.status == "caution" and head.gaps and stage != "validation":  # whose own headline says what is open
        below = joined([whole_sentence(joined(dict.fromkeys(head.gaps), ", ")), answer.below], " ")
        answer = replace(answer, rest=tr("Not fully checked."), below=below, good=head.summary.verdict.lowered)
    if head.no_verdict:
        said = answer if not answer.headline else Answer("", tr("Nothing here holds for this robot."))
        answer = replace(said, headline=tr("Another arm's table."))
        context["instead"] = alternative_table(study, stored.robot, stored.folder)
    template = _HERE.parent / "stages" / stage / "page" / "report.html.j2"
    render(template, output, head.summary, answer=answer, never=never_text(stage), **framed | context)


def _framed(study: Study, stored: Stored[Any]) -> dict[str, Any]:
    """What frames the page of a stage of a robot, whether or not there are numbers of it."""
    name, stage = stored.robot, stored.stage
    return {
        "head": head_of(stored),
        "robots": robots_with(study, stage),
        "command": run_command(study, f"{name}/{stage}.html"),
        "robot": study.robot(name),
        "robot_pages": study.pages(name),
    }


def robots_with(study: Study, page: str) -> list[tuple[str, str, str]]:
    """The robots of a study that have a page: name, title, and its address from a robot's page."""
    return [
        (name, language.own_title(study.robot(name).title), f"../{name}/{page}.html")
        for name in study.names
        if page in study.pages(name)
    ]


BRACKETS = re.compile(r"(?<=>)(?<!<code>)([^<>()]{1,40}) \(([^<>()]{1,20})\)(?=</t[hd]>)")
STOPS = re.compile(r"(</(?:a|code|em|strong)>)\.(?=[\s<])")
BLANKS = re.compile(
    r"(?<=[，。；：！？、])(?:[ \n]+|&nbsp;)(?=[^\s])"  # behind full-width marks
    r"|(?<=[\u4e00-\u9fff]) +(?=[\u4e00-\u9fff])"  # between two characters
    r"|(?<=\d) +(?=°)"
)


def closed_up(html: str) -> str:
    """A page in Chinese without the blanks that Chinese does not write, and with its own brackets and full stops.

    Parameters
    ----------
    html : of the whole page

    Returns
    -------
    html : text within ``<code>`` keeps its brackets
    """
    return BRACKETS.sub(r"\1（\2）", BLANKS.sub("", STOPS.sub(r"\1。", html)))


def breakable(name: str) -> Markup:
    """A name that may go on in the next line after each of its underscores.

    Parameters
    ----------
    name : plain; it is escaped here

    Returns
    -------
    html : with ``<wbr>``
    """
    return Markup("_<wbr>").join(name.split("_"))


def whole_sentence(finding: str) -> str:
    """A finding's text as a sentence of its own.

    Parameters
    ----------
    finding : text without a full stop, in the language in use

    Returns
    -------
    text : with a full stop and, in other languages than Chinese, a capital letter
    """
    text = tr("{finding}.", finding=finding)
    return text[:1].upper() + text[1:] if language.current() != "zh" else text


def run_command(study: Study, page: str) -> str | None:
    """The command that makes a page of a study again, results included; None for a study that no file holds.

    Parameters
    ----------
    page : its path below the reports
    """
    if study.file is None:
        return None
    file = from_here(study.file)
    if INSTALLED:
        return shlex.join(["er3a", "run", "--study", file, f"reports/{page}"])
    return shlex.join(["make", "run", f"STUDY={file}", f"ARGS=reports/{page}"])


def text_address(text: str) -> str:
    """The data address of a file of text, for a link that saves it.

    Parameters
    ----------
    text : content of the file

    Returns
    -------
    address : ``data:text/plain;base64,...``
    """
    return f"data:text/plain;base64,{base64.b64encode(text.encode()).decode()}"


def packed_text(text: str) -> str:
    """A text for a link's ``data-packed``, which the page's script unpacks to be saved.

    Parameters
    ----------
    text : content of the file

    Returns
    -------
    packed : gzip, in base64; equal texts give equal ones
    """
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def _preview(picture: Path) -> str | None:
    """The picture of a recording as a data address; None where there is none."""
    if not picture.is_file():
        return None
    return "data:image/webp;base64," + base64.b64encode(picture.read_bytes()).decode("ascii")


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version(), "er3a": __version__}
    for name in SHOWN_VERSIONS:
        try:
            found[name] = version(name)
        except ModuleNotFoundError:
            continue
    return found


def _commit() -> str | None:
    """Commit of the project's checkout, with ``+ changes`` if it is dirty; None outside a checkout."""

    def git(*words: str) -> str | None:
        command = ["git", "-C", str(ROOT), *words]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return None
        return done.stdout.strip() if done.returncode == 0 else None

    if git("rev-parse", "--show-toplevel") != str(ROOT):
        return None
    commit = git("rev-parse", "--short=12", "HEAD")
    return commit and commit + (" + changes" if git("status", "--porcelain", "--untracked-files=no") else "")


def alternative_table(study: Study, robot: str, folder: Path | None) -> str | None:
    """A robot of the study that one of this robot's reference sets is about, and that its own evidence bears out.

    Parameters
    ----------
    folder : of the results of any of the robot's stages

    Returns
    -------
    name : of the other robot, with a verdict of pass or caution; None where none was computed or bears out
    """
    results = folder.parents[1] if folder else Path()
    for other in study.other_tables(robot):
        try:
            status = read_status(results / other / "validation")
        except ResultError:
            continue
        if status in ("pass", "caution"):
            return other
    return None


def panel_link(q_deg: Iterable[float], text: str) -> str:
    """A text that leads to the arm at joint values in the teach panel.

    Parameters
    ----------
    q_deg : (n,), deg, or mm of joints that slide
    text : plain; it is escaped here

    Returns
    -------
    html : a link; the values are written with nine digits
    """
    return Markup('<a href="{}">{}</a>').format(panel_address(q_deg), text)


def panel_address(q_deg: Iterable[float]) -> str:
    """Where the teach panel shows the arm at joint values (n,), deg, or mm of joints that slide."""
    return "teach.html#q=" + ",".join(f"{round(float(angle), 9) + 0.0:.9g}" for angle in q_deg)


def report_absent(study: Study, stored: Stored[AbsentResults], output: Path) -> None:
    """Write the page of a stage that was not computed: the verdict, and where it comes from.

    Parameters
    ----------
    stored : with the reason
    output : the page, written whole or not at all
    """
    framed = _framed(study, stored)
    answer = Answer(tr("Not computed."), below=framed["head"].text)
    render(_HERE / "absent.html.j2", output, answer=answer, never="", **framed)
