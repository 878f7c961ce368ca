"""Jobs without start-up time: a process with all libraries loaded forks one child for each job of a run.

A study has about fifty short jobs, and importing NumPy, pandas, Matplotlib, numba and others takes longer than many of
them need. While a study runs on this machine, ``er3a compute``, ``er3a report`` and the other commands called by
Snakemake's rules only pass their arguments, working folder, environment and standard streams to this server, which
forks a child to do the job. Without a server (on a cluster, by hand, or where forking is not safe) they do the job
themselves; results have the same bytes.

A child ends with the command that requested it, and the server with the run that started it, in whatever way those end,
because the system closes the connection.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

VERBS = ("sample", "compute", "record", "report", "teach", "index")
ADDRESS = "ER3A_JOB_SERVER"
SETTINGS = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
"""Of the environment of jobs, what libraries read when they are loaded."""
_STREAMS = (0, 1, 2)
_LENGTH = struct.Struct("!I")
_CODE = struct.Struct("!B")


def hand_over(words: Sequence[str]) -> int | None:
    """Have the server do a job.

    Parameters
    ----------
    words : of the command line, the verb first

    Returns
    -------
    code : the job's exit code; None without a server for it
    """
    address = os.environ.get(ADDRESS)
    if not address or not words or words[0] not in VERBS or any(os.environ.get(k) != v for k, v in SETTINGS.items()):
        return None
    asked = json.dumps({"words": list(words), "folder": os.getcwd(), "environment": dict(os.environ)}).encode()
    with socket.socket(socket.AF_UNIX) as line:
        try:
            line.connect(address)
            socket.send_fds(line, [_LENGTH.pack(len(asked))], _STREAMS)
            line.sendall(asked)
        except OSError:
            return None
        code = line.recv(_CODE.size)
    return _CODE.unpack(code)[0] if code else 128 + signal.SIGKILL  # no code: the child was killed


@contextmanager
def running(keep_open: int) -> Iterator[None]:
    """A server for the jobs that are started meanwhile by this process and its children.

    Parameters
    ----------
    keep_open : a file that jobs hold open as long as they run (the lock of a run)
    """
    if sys.platform != "linux":  # elsewhere libraries may not survive a fork
        yield
        return
    with tempfile.TemporaryDirectory(prefix="er3a-") as folder:
        address = str(Path(folder, "jobs"))
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(address)
            listener.listen(64)
            command = [sys.executable, "-m", "er3a.pipeline.job_server", str(listener.fileno())]
            handed = (listener.fileno(), keep_open)
            server = subprocess.Popen(
                command, stdin=subprocess.PIPE, pass_fds=handed, env=os.environ | SETTINGS, start_new_session=True
            )
        os.environ[ADDRESS] = address
        try:
            yield
        finally:
            del os.environ[ADDRESS]
            server.communicate()


def serve(listener: socket.socket) -> None:
    """Fork a child for each requested job, until standard input is closed."""
    import gc
    import selectors

    load_libraries()
    gc.freeze()  # so that collecting garbage in a child copies no pages
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # no child is waited for
    selector = selectors.DefaultSelector()
    selector.register(listener, selectors.EVENT_READ)
    selector.register(sys.stdin, selectors.EVENT_READ)
    while True:
        ready = [key.fileobj for key, _ in selector.select()]
        if sys.stdin in ready:
            return
        line, _ = listener.accept()
        with line:
            if os.fork() == 0:
                selector.close()
                listener.close()
                _do(line)


def load_libraries() -> None:
    """Import what jobs import, but for Rerun, which starts threads as it is loaded: they do not survive a fork.

    Numba looks up what it knows of Python and NumPy before the first kernel that a process loads: 0.4 s of each job.
    """
    from importlib import import_module

    from numba.core.registry import cpu_target

    from er3a.pipeline.stages.registry import STAGES

    for stage in STAGES.values():
        import_module(stage.messages)
        for verb in ("compute", "report"):
            with suppress(ImportError):  # the job that needs it says so
                stage.module(verb)
    for module in ("cli", "stages.run", "viewing.index", "teach.panel"):
        import_module(f"er3a.pipeline.{module}")
    for context in (cpu_target.typing_context, cpu_target.target_context):
        context.refresh()  # type: ignore[no-untyped-call]


def _do(line: socket.socket) -> None:
    """Do one job in this process, as its command would, and end."""
    import threading

    os.setsid()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    code = 1
    try:
        head, streams, _, _ = socket.recv_fds(line, _LENGTH.size, len(_STREAMS))
        with line.makefile("rb") as asked:
            job = json.loads(asked.read(_LENGTH.unpack(head)[0]))
        for own, stream in zip(_STREAMS, streams, strict=True):
            os.dup2(stream, own)
            os.close(stream)
        os.chdir(job["folder"])
        os.environ.clear()
        os.environ.update(job["environment"])
        sys.argv = ["er3a", *job["words"]]
        threading.Thread(target=_end_with, args=(line,), daemon=True).start()
        code = _run()
    finally:
        with suppress(OSError):
            line.send(_CODE.pack(code))
        os._exit(code)


def _run() -> int:
    """The exit code of the command line called with ``sys.argv``."""
    import traceback

    from er3a.pipeline.cli import main

    code = 1
    try:
        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # as the interpreter would end
        traceback.print_exc()
    with suppress(OSError, ValueError):
        sys.stdout.flush()
        sys.stderr.flush()
    return code & 0xFF


def _end_with(line: socket.socket) -> None:
    """End this process and what it started when the command that requested the job has ended."""
    with suppress(OSError):
        line.recv(1)
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])))
