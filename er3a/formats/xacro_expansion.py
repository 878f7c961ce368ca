"""``python -m er3a.formats.xacro_expansion FILE ARGUMENTS``: the URDF that a xacro file makes, on standard output.

Its expressions are Python. xacro keeps builtins from them and refuses names with two underscores, but neither in
lambdas and comprehensions, nor from ``$(eval ...)``, nor from ``python.vars``; so the rest is refused here, and
``$(eval ...)`` is evaluated as ``${...}`` is. Memory and files written are limited by the system, time by the process
that calls this one. The last line on standard error says why nothing could be made.

Files from before 2014 write the tags in ``OLD`` without ``xacro:``.
"""

from __future__ import annotations

import ast
import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

MOST_TEXT = 20_000_000  # letters of a URDF
MOST_MEMORY = 2_000_000_000  # bytes of addresses; the interpreter and xacrodoc take a tenth
FOLDERS_UP = 4  # in and beside which packages are looked for
OLD = ("property", "macro", "include", "insert_block", "if", "unless")
INNER = re.compile(r"_|(gi|cr|ag|tb)_")  # attributes that lead from a value to the interpreter


def main(file: str, arguments: str) -> None:
    """Expand a xacro file and write the URDF to standard output.

    Parameters
    ----------
    arguments : a JSON object of texts, by the names of the file's arguments

    Notes
    -----
    If that fails, the reason is the last line on standard error, and the process ends with exit code 1.
    """
    _limit()
    try:
        with redirect_stdout(sys.stderr):
            text = _expanded(Path(file), json.loads(arguments))
    except Exception as error:  # whatever a macro makes its expander stumble over
        print("\n" + (" ".join(str(error).split()) or type(error).__name__), file=sys.stderr)
        sys.exit(1)
    sys.stdout.buffer.write(text.encode())


def _limit() -> None:
    if sys.platform == "win32":  # has no such limits
        return
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


def _expanded(path: Path, values: dict[str, str]) -> str:
    import xacro
    from xacro import substitution_args
    from xacrodoc import packages

    evaluate, load, parse = xacro.safe_eval, xacro.load_yaml, xacro.parse

    def checked(expression: str, *names: Any) -> Any:
        for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
            name: str = getattr(node, "attr", "") or getattr(node, "id", "")
            if INNER.match(name) and (isinstance(node, ast.Attribute) or name.startswith("__")):
                raise ValueError(f"the name {name} is refused in expressions")
        return evaluate(expression, *names)

    def of_arguments(expression: str, context: dict[str, Any]) -> str:
        given = {name: substitution_args.convert_value(str(value), "auto") for name, value in context["arg"].items()}
        return str(checked(expression, {**xacro._global_symbols, **given, "arg": given.__getitem__}))

    def yaml_alone(file: str) -> object:
        if Path(xacro.abs_filename_spec(file)).resolve().suffix.lower() not in (".yaml", ".yml"):
            raise ValueError("load_yaml reads .yaml files alone")
        return load(file)

    def parsed(*source: Any) -> Any:
        document = parse(*source)
        for tag in OLD:
            for element in document.getElementsByTagName(tag):
                element.tagName = f"xacro:{tag}"
        return document

    xacro.safe_eval, substitution_args._eval, xacro.parse = checked, of_arguments, parsed
    del xacro._global_symbols["python"]["vars"]
    xacro._global_symbols["load_yaml"] = xacro._global_symbols["xacro"]["load_yaml"] = yaml_alone
    packages.reset()
    packages.update_package_cache(packages_near(path))
    text: str = xacro.process_file(str(path), mappings=values).toprettyxml()
    if len(text) > MOST_TEXT:
        raise ValueError(f"the URDF would have more than {MOST_TEXT:,} letters")
    return text


def packages_near(path: Path) -> dict[str, Path]:
    """Packages of ROS by name, as far as they can be guessed from the folders around a file.

    Parameters
    ----------
    path : of the xacro file

    Returns
    -------
    folders : the ``FOLDERS_UP`` folders above the file and those in them, by folder name; these and those two below,
        such as packages of another repository in the same workspace, by the name in their ``package.xml``; of two with
        one name the nearer one
    """
    found: dict[str, Path] = {}
    for above in reversed(path.resolve().parents[:FOLDERS_UP]):
        found |= {folder.name: folder for folder in (*sorted(above.glob("*/")), above)}
        for depth in ("*/*/", "*/", ""):
            found |= {_package_name(each): each.parent for each in sorted(above.glob(f"{depth}package.xml"))}
    return found


def _package_name(manifest: Path) -> str:
    try:
        name = ElementTree.parse(manifest).findtext("name")
    except ElementTree.ParseError:
        name = None
    return (name or manifest.parent.name).strip()


if __name__ == "__main__":
    main(*sys.argv[1:])
