"""The core imports without what belongs to Linux, and without the libraries of extras; what is absent is named."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
import typer

from er3a.errors import MissingLibraryError, with_extra
from er3a.pipeline.commands.names import COMMANDS, app
from tests.conftest import ROOT

pytestmark = pytest.mark.long

WITHOUT = """
import os, signal, subprocess, sys
blocked = set(sys.argv[1].split())

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in blocked:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocked())
"""
# What Windows has neither as a module nor in those that it has; libraries take what they want of these before.
POSIX_ALONE = """
import importlib, pathlib
import jinja2, PIL.Image, pydantic, rich.console, scipy.optimize, scipy.spatial, trimesh, typer, yaml
for library in sys.argv[2].split():
    importlib.import_module(library)
for module, names in ((os, "fork getuid killpg setsid sched_getaffinity O_CLOEXEC O_NONBLOCK uname statvfs".split()),
                      (signal, "SIGKILL SIGALRM SIGHUP setitimer alarm".split())):
    for name in names:
        delattr(module, name)
for name in "fcntl resource pwd grp termios tty pty".split():
    sys.modules.pop(name, None)
"""
IMPORT_ALL = """
import er3a, importlib, pathlib
from er3a.errors import MissingLibraryError, with_extra
root = pathlib.Path(er3a.__file__).parent
for file in sorted(root.rglob("*.py")):
    name = ".".join(file.relative_to(root.parent).with_suffix("").parts).removesuffix(".__init__")
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if not isinstance(with_extra(error), MissingLibraryError):
            raise
        print(name, error.name.partition(".")[0])
for name in er3a.__all__:
    try:
        getattr(er3a, name)
    except MissingLibraryError as error:
        print(f"er3a.{name}", error.module)
"""
POSIX = "fcntl resource pwd grp termios tty pty syslog"
LINUX_WHEELS = "pinocchio coal ompl toppra libusb_package"
EXTRAS = """babel contourpy cv2 collada filelock libusb_package llvmlite matplotlib networkx numba open3d pandas
psutil pyarrow rerun snakemake snakemake_interface_logger_plugins xacro xacrodoc"""
OF_STUDIES = (
    "er3a.numerics.machine_code",
    "er3a.pipeline.article",
    "er3a.pipeline.overview",
    "er3a.pipeline.parquet",
    "er3a.pipeline.player.turning",
    "er3a.pipeline.run_study",
    "er3a.pipeline.viewing",
)
OF_STAGES = ".page."


def missing(code: str, *words: str) -> dict[str, str]:
    """Modules of er3a that a process can't import, and the library that each lacks."""
    done = subprocess.run([sys.executable, "-c", code, *words], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return dict(line.split() for line in done.stdout.splitlines())


def test_every_module_imports_where_nothing_of_posix_is():
    libraries = "babel filelock matplotlib numba pandas pyarrow rerun snakemake.cli"
    blocked = f"{POSIX} {LINUX_WHEELS}"
    # Libraries load what Linux has before it is taken away; er3a afterwards.
    code = WITHOUT.replace("sys.meta_path", POSIX_ALONE + "sys.meta_path") + IMPORT_ALL
    assert missing(code, blocked, libraries) == {}


def test_the_core_imports_without_the_libraries_of_extras():
    lacking = missing(WITHOUT + IMPORT_ALL, f"{EXTRAS} {LINUX_WHEELS}")
    assert {"er3a.pipeline.run_study", "er3a.pipeline.parquet"} <= lacking.keys()
    assert lacking.pop("er3a.plot") == "matplotlib"
    assert [name for name in lacking if OF_STAGES not in name and not name.startswith(OF_STUDIES)] == []


@pytest.mark.parametrize(
    ("words", "extra"), [(("run",), "study"), (("compare", "er3_600", "er3_600", "--html", "a.html"), "")]
)
def test_a_command_says_in_one_line_which_extra_it_needs(tmp_path: Path, words: tuple[str, ...], extra: str):
    code = WITHOUT + "from er3a.__main__ import main\nsys.argv = ['er3a', *sys.argv[2:]]\nmain()"
    command = [sys.executable, "-c", code, f"{EXTRAS} {LINUX_WHEELS}", *words]
    done = subprocess.run(
        command, cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    if extra:
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert f"er3a[{extra}]" in done.stderr
    else:
        assert done.returncode == 0, done.stderr


def test_only_libraries_of_extras_are_named_as_such():
    assert isinstance(with_extra(ModuleNotFoundError(name="pyarrow.parquet")), MissingLibraryError)
    other = ModuleNotFoundError(name="fcntl")
    assert with_extra(other) is other


def test_help_and_commands_say_the_same():
    for name, (room, panel, line) in COMMANDS.items():
        import_module(f"er3a.pipeline.commands.{room}")
        command = typer.main.get_group(app).commands[name]
        said = " ".join((command.help or "").split("\n\n")[0].split())
        assert (command.rich_help_panel, said) == (panel, line)  # type: ignore[attr-defined]


def test_help_loads_no_numerics():
    code = "import sys; from er3a.__main__ import main; sys.argv = ['er3a', '--help']\n"
    code += "try:\n main()\nfinally:\n print(*(name for name in ('scipy', 'numba', 'pydantic') if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == ""
