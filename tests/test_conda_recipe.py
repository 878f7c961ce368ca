"""The conda recipe asks for what the package asks for."""

from __future__ import annotations

import re
import tomllib

import yaml

from er3a.version import __version__
from tests.conftest import ROOT

IN_CONDA = {
    "coal": "coal-python",
    "libusb-package": "libusb",
    "matplotlib": "matplotlib-base",
    "open3d-cpu": "open3d",
    "pin": "pinocchio",
    "snakemake": "snakemake-minimal",
}
UNBOUNDED = {"libusb"}  # versions of the library, not of the wheel that carries it


def test_the_conda_recipe_has_the_package_s_version_programs_and_dependencies():
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert recipe["context"]["version"] == __version__
    programs = dict(entry.split(" = ") for entry in recipe["build"]["python"]["entry_points"])
    assert programs == project["scripts"]
    wanted = {"python": project["requires-python"]}
    study = project["optional-dependencies"]
    for line in (*project["dependencies"], *study["study"][1:], *study["fast"]):
        name, bounds = re.match(r"([\w-]+)([^;]*)", line).groups()
        name = IN_CONDA.get(name, name)
        wanted[name] = "" if name in UNBOUNDED else bounds.strip()
    asked = dict(line.partition(" ")[::2] for line in recipe["requirements"]["run"])
    assert asked == wanted
