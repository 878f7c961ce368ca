"""The documentation site: guides, notebooks that run at build time, and a reference made from docstrings.

`make docs` builds it into docs/_build/html, with warnings as errors. What is made at build time stands in
docs/generated: a page for each module, the table of public names, and the gallery of the pages in reports/.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from importlib import import_module
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
GENERATED = DOCS / "generated"
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))  # of notebooks

import er3a  # noqa: E402
from er3a.pipeline.stages.registry import STAGES  # noqa: E402

project = "er3a"
author = "The er3a authors"
copyright = "The er3a authors. MIT licence"
release = version = er3a.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "sphinx_copybutton"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"er3a {er3a.__version__}"
html_static_path = ["static"]
html_css_files = ["site.css"]

myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True

viewcode_follow_imported_members = False  # a constant's type would lead to the module of that type
autodoc_typehints = "none"  # the docstrings tell shapes and units
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": False}
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
suppress_warnings = ["ref.python"]  # names of attributes are looked up, and several classes have a `lower`

ROOMS = {
    "Robots and geometry": ("geometry", "robots"),
    "Kinematics": ("kinematics", "sampling"),
    "What an arm can reach": ("workspace",),
    "Paths": ("planning", "collision"),
    "Choosing solutions": ("selection",),
    "Comparing arms": ("comparison",),
    "References, diagnosis, calibration": ("references", "identifiability", "diagnosis", "calibration", "confirmation"),
    "Robot programs": ("programs", "program_check"),
    "What the motors feel": ("dynamics",),
    "Cameras": ("vision",),
    "Files and formats": ("formats", "files"),
    "Beneath": ("numerics",),
}
TABLE = ("| module | what it is about |", "|---|---|")
ALONE = ("errors", "by_value", "public")


def first_sentence(text: str | None) -> str:
    """What a table says of a name."""
    paragraph = " ".join((text or "").strip().partition("\n\n")[0].split())
    sentence = re.split(r"\. |; see :|\.$", paragraph)[0]
    return re.sub(r" \[\d\]_", "", sentence)


def module_name(path: Path) -> str:
    """The full name of a module of er3a."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def write_module_page(path: Path) -> str:
    """A page on a module, in no table of contents: hundreds of entries on each page take minutes; returns its row."""
    name = module_name(path)
    text = f":orphan:\n\n{name}\n{'=' * len(name)}\n\n.. automodule:: {name}\n"
    (GENERATED / f"{name}.rst").write_text(text, encoding="utf-8")
    return f"| {{py:mod}}`{name}` | {first_sentence(import_module(name).__doc__)} |"


def write_reference() -> None:
    """The pages on all modules, and one that lists them."""
    library = {path.parent.name for path in ROOT.glob("er3a/*/__init__.py")} - {"pipeline"}
    if missing := library - {room for rooms in ROOMS.values() for room in rooms}:
        raise ValueError(f"rooms that the reference leaves out: {sorted(missing)}")
    parts = ["# Modules\n", "All modules of the library, by what they are about; `er3a` names the public functions.\n"]
    for title, rooms in ROOMS.items():
        paths = [path for room in rooms for path in sorted((ROOT / "er3a" / room).rglob("*.py"))]
        rows = [write_module_page(path) for path in paths if path.stem != "__init__"]
        parts += [f"## {title}\n", *TABLE, *rows, ""]
    rows = [write_module_page(ROOT / f"er3a/{stem}.py") for stem in ALONE]
    parts += ["## For all of them\n", *TABLE, *rows, ""]
    (GENERATED / "modules.md").write_text("\n".join(parts), encoding="utf-8")


def write_public() -> None:
    """The public names, each with the page that tells of it."""
    rows = ["# Public names\n", "What `import er3a` offers. Each refuses unusable arguments with an `Er3aError`.\n"]
    rows += ["| name | what it is |", "|---|---|"]
    for name, module in er3a._PUBLIC.items():
        found = getattr(import_module(module), name)
        role = "class" if isinstance(found, type) else "func"
        rows.append(f"| {{py:{role}}}`er3a.{name} <{module}.{name}>` | {first_sentence(found.__doc__)} |")
    (GENERATED / "public.md").write_text("\n".join(rows) + "\n", encoding="utf-8")


def write_gallery(app: Sphinx) -> None:
    """The pages of the study that was run last, copied into the site as they stand: they link to each other."""
    reports, gallery = ROOT / "reports", Path(app.outdir) / "gallery"
    shutil.rmtree(gallery, ignore_errors=True)
    parts = ["# Gallery of pages\n"]
    if not (reports / "index.html").is_file():
        parts.append("The pages of a study are shown here if one was run first: `make run`, then `make docs`.")
    else:
        shutil.copytree(reports, gallery, ignore=shutil.ignore_patterns("*.rrd", "*.xml", "*.md", ".*"))
        robots = sorted(path.parent.name for path in gallery.glob("*/validation.html"))
        parts += ["What `make run` writes, as it is: each page is one file that works offline.\n"]
        parts += [f"| | {' | '.join(robots)} |", f"|---{'|---' * len(robots)}|"]
        for stage in (*STAGES, "teach"):
            links = [_linked(gallery / robot / f"{stage}.html") for robot in robots]
            parts.append(f"| {stage} | {' | '.join(links)} |")
    (GENERATED / "gallery.md").write_text("\n".join(parts) + "\n", encoding="utf-8")


def _linked(page: Path) -> str:
    """The link to a page of the gallery, with its picture; nothing if there is no such page."""
    if not page.is_file():
        return ""
    picture, shown = page.with_suffix(".webp"), page.stem
    if picture.is_file():
        shown = f'<img src="../gallery/{page.parent.name}/{picture.name}" width="150" alt=""><br>{page.stem}'
    return f'<a href="../gallery/{page.parent.name}/{page.name}">{shown}</a>'


def write_generated(app: Sphinx) -> None:
    """All that is made at build time."""
    GENERATED.mkdir(exist_ok=True)
    write_reference()
    write_public()
    write_gallery(app)


def leave_out_private(app: Sphinx, what: str, name: str, obj: object, skip: bool, options: object) -> bool | None:
    """Private names have no place in the reference."""
    return True if name.startswith("_") else None


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("builder-inited", write_generated)
    app.connect("autodoc-skip-member", leave_out_private)
