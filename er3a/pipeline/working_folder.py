"""What lies in the working folder is data: nothing of it runs as code, here or in the processes that this one starts.

A study is handed from one person to the next, and a run begins in its folder. Python would import modules from there
(``python -m``, an empty entry of ``PYTHONPATH``), and some libraries take settings, pickles or plugins from there.
"""

from __future__ import annotations

import os
import sys

CODE_OF_LIBRARIES = {
    ".numba_config.yaml": "numba would take from it where compiled code is loaded from",
    ".snakemake/pip-deployments": "Snakemake would load Python modules from it",
}
"""Places below the working folder that no study needs, and why they are refused."""
STATE = ".snakemake"


def distrust() -> None:
    """Keep Python from importing what the working folder holds. To be called before other modules are loaded.

    What Python itself loads before (``sitecustomize``, with an empty entry in ``PYTHONPATH``) is out of its reach. Ends
    the command with one line and exit code 2 in a folder that holds code of libraries.
    """
    os.environ["PYTHONSAFEPATH"] = "1"  # child processes import nothing from the folder that they begin in
    if named := os.environ.get("PYTHONPATH"):
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(os.path.isabs, named.split(os.pathsep)))
    here, own = os.path.realpath("."), os.path.realpath(os.path.join(__file__, "..", "..", ".."))
    if here != own:
        sys.path[:] = [place for place in sys.path if os.path.realpath(place) != here]
    linked = {STATE: "a run deletes files in it, and it links to another folder"} if os.path.islink(STATE) else {}
    for place, why in (CODE_OF_LIBRARIES | linked).items():
        if os.path.lexists(place):
            print(f"error: {place}: {why}. Move it out of this folder", file=sys.stderr)
            sys.exit(2)
