"""Set-up and runs where paths, names and networks are unlike a developer's own."""

from __future__ import annotations

import base64
import hashlib
import os
import shutil
import ssl
import subprocess
import sys
import threading
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from testing.processes import run
from testing.small_study import ROOT

pytestmark = pytest.mark.long

ODD_STUDY = "config/one's ü.yaml"
WHEEL = "tiny-1.0-py3-none-any.whl"

needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")


def copied(fresh_project, folder: Path):
    """The project in a folder, with this environment in the place of the one that it would set up."""
    project = fresh_project("office")
    moved = Path(shutil.move(project.folder, folder))
    shutil.copy2(ROOT / "Makefile", moved)
    (moved / ".venv").symlink_to(sys.prefix)
    return moved


@needs_make
def test_a_study_and_a_checkout_with_blanks_quotes_and_umlauts(fresh_project, tmp_path):
    folder = copied(fresh_project, tmp_path / "my cöpy of it")
    study = folder / ODD_STUDY
    study.write_text((folder / "config/small.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    table = "results/er3_600/dynamics/summary.json"  # the stage that takes least
    as_set_up = ["-o", ".venv/run.stamp", "-o", ".venv/uv.stamp"]
    command = ["make", *as_set_up, "run", f"STUDY={ODD_STUDY}", f"ARGS=--cores 1 {table}"]
    done = run(command, cwd=folder, env=os.environ | {"PYTHONPATH": str(folder)})
    assert done.returncode == 0, done.stderr
    assert (folder / table).is_file()


@contextmanager
def https_index(folder: Path) -> Iterator[tuple[str, Path]]:
    """A package index on this machine that signs with a certificate which nobody knows.

    Yields
    ------
    address : of the index
    authority : the certificate to be trusted
    """
    index = folder / "index"
    (index / "simple/tiny").mkdir(parents=True)
    with zipfile.ZipFile(index / "simple/tiny" / WHEEL, "w") as wheel:
        files = {
            "tiny.py": "answer = 42\n",
            "tiny-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: tiny\nVersion: 1.0\n",
            "tiny-1.0.dist-info/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        }
        sums = {
            name: base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()
            for name, text in files.items()
        }
        rows = [f"{name},sha256={sums[name]},{len(text)}" for name, text in files.items()]
        for name, text in (*files.items(), ("tiny-1.0.dist-info/RECORD", "\n".join(rows) + "\n")):
            wheel.writestr(name, text)
    (index / "simple/tiny/index.html").write_text(f'<a href="{WHEEL}">{WHEEL}</a>', encoding="utf-8")
    authority, certificate, key = _certificates(folder)
    server = ThreadingHTTPServer(("localhost", 0), partial(_Silent, directory=str(index)))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"https://localhost:{server.server_port}/simple", authority
    finally:
        server.shutdown()
        server.server_close()


def _certificates(folder: Path) -> tuple[Path, Path, Path]:
    """An authority's certificate; one for this machine that it signed, and its key."""
    authority, request, certificate, names = (folder / name for name in ("ca.pem", "a.csr", "a.pem", "names"))
    names.write_text("subjectAltName=DNS:localhost\nbasicConstraints=CA:FALSE\n", encoding="utf-8")
    new_key = ["-newkey", "rsa:2048", "-nodes", "-keyout"]
    signed = ["-CA", authority, "-CAkey", folder / "ca.key", "-CAcreateserial", "-extfile", names]
    for words in (
        ["req", "-x509", *new_key, folder / "ca.key", "-days", "2", "-subj", "/CN=The office", "-out", authority],
        ["req", *new_key, folder / "a.key", "-subj", "/CN=localhost", "-out", request],
        ["x509", "-req", "-in", request, "-days", "2", *signed, "-out", certificate],
    ):
        subprocess.run(["openssl", *words], check=True, capture_output=True)
    return authority, certificate, folder / "a.key"


class _Silent(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Nothing is told of requests."""


@pytest.fixture(scope="module")
def own_venv(tmp_path_factory) -> Path:
    """An environment with pip, whose settings the Makefile asks for, and this environment's uv; to be copied."""
    venv = tmp_path_factory.mktemp("made") / ".venv"
    subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    (venv / "bin/uv").symlink_to(Path(sys.prefix, "bin/uv"))
    (venv / "uv.stamp").touch()
    return venv


@needs_make
@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
@pytest.mark.skipif(not Path(sys.prefix, "bin/uv").is_file(), reason="uv is not installed here")
@pytest.mark.parametrize("told_to", ["environment", "settings"])
def test_uv_takes_certificate_and_index_that_only_pip_was_told(tmp_path, own_venv, told_to):
    folder = tmp_path / "an office"
    (folder / "requirements").mkdir(parents=True)
    shutil.copy2(ROOT / "Makefile", folder)
    shutil.copytree(own_venv, folder / ".venv", symlinks=True)
    (folder / "pyproject.toml").touch()  # nothing to build: make ends behind the lock, which is what counts here
    (folder / "requirements/uv.txt").touch()
    with https_index(tmp_path) as (address, certificate):
        sum_of = hashlib.sha256((tmp_path / "index/simple/tiny" / WHEEL).read_bytes()).hexdigest()
        (folder / "requirements/run.txt").write_text(f"tiny==1.0 --hash=sha256:{sum_of}\n", encoding="utf-8")
        settings = tmp_path / "pip.conf"
        known = {"PIP_CERT": str(certificate), "PIP_INDEX_URL": address}
        if told_to == "settings":
            settings.write_text(f"[global]\ncert = {certificate}\nindex-url = {address}\n", encoding="utf-8")
            known = {"PIP_CONFIG_FILE": str(settings)}
        network = ("SSL_", "PIP_", "UV_", "HTTP", "http", "REQUESTS", "ALL_PROXY", "all_proxy", "PYTHONPATH")
        kept = {key: value for key, value in os.environ.items() if not key.startswith(network)}
        environment = kept | known | {"UV_NO_CACHE": "1", "NO_PROXY": "localhost"}
        run(["make", "-o", ".venv/uv.stamp", ".venv/run.stamp"], cwd=folder, env=environment)
    found = run([folder / ".venv/bin/python", "-c", "import tiny; print(tiny.answer)"])
    assert found.stdout == "42\n"
