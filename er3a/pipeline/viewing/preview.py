"""A picture of a recording as it opens, drawn by the real viewer, also without a display."""

from __future__ import annotations

import io
import re
import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from rerun.experimental import ViewerClient

from er3a.errors import Er3aError
from er3a.files.kept_files import write_atomically
from er3a.pipeline.viewing.viewer import LOOPBACK, free_port, viewer_running

WINDOW = (1200, 780)  # pixels
TITLE_BAR = 36
TIME_BAR = 34  # left out: it fills as loading goes
QUALITY = 75
PATIENCE_S = 60


def draw_preview(recording: Path, output: Path) -> str | None:
    """Draw a recording as a WebP picture.

    Returns
    -------
    why it could not be drawn, None if it was; what could not be drawn becomes an empty file
    """
    try:
        picture = _picture(recording)
    except Er3aError as error:
        write_empty(output)
        return str(error)
    write_atomically(output, lambda file: file.write_bytes(picture))
    return None


def write_empty(output: Path) -> None:
    """Write the picture of a recording that is not drawn."""
    write_atomically(output, lambda file: file.write_bytes(b""))


def _picture(recording: Path) -> bytes:
    with TemporaryDirectory(prefix="er3a-preview-") as folder:
        shot, messages, port = Path(folder) / "shot.png", Path(folder) / "messages", free_port()
        size = "x".join(map(str, WINDOW))
        words = ("--headless", "--port", str(port), "--window-size", size, "--hide-welcome-screen")
        with viewer_running([recording], *words, messages=messages) as viewer:
            try:
                _shoot(port, viewer, shot)
            except EOFError:
                raise Er3aError(_why(messages.read_text(errors="replace"))) from None
        image = Image.open(shot).convert("RGB")
        views = image.crop((0, TITLE_BAR, image.width, image.height - TIME_BAR))
        encoded = io.BytesIO()
        views.save(encoded, "WEBP", quality=QUALITY, method=6)
        return encoded.getvalue()


def _shoot(port: int, viewer: subprocess.Popen[bytes], shot: Path) -> None:
    """Have the viewer save pictures until one is like the one before: everything is loaded then.

    Raises
    ------
    EOFError
        if the viewer ends
    Er3aError
        if that takes longer than PATIENCE_S
    """
    client, bare, before = None, False, b""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if viewer.poll() is not None:
            raise EOFError
        try:
            client = client or ViewerClient(f"rerun+http://{LOOPBACK}:{port}/proxy")
            state = client.get_state()
            if not state.active_recording or state.loading:
                time.sleep(0.05)
                continue
            if not bare:
                client.run_command("ui.toggle_blueprint_panel")  # its tree unfolds or not, as loading goes
                bare = True
            client.save_screenshot(str(shot))
        except (ConnectionError, RuntimeError):
            time.sleep(0.05)
            continue
        if shot.read_bytes() == before:
            return
        before = shot.read_bytes()
    raise Er3aError(f"the viewer drew no steady picture in {PATIENCE_S} s")


def _why(messages: str) -> str:
    panic = re.search(r"panicked at '(.+?)'\n", messages, flags=re.DOTALL)
    said = panic[1] if panic else (messages.strip().splitlines() or ["without a word"])[-1]
    return f"the Rerun viewer ended: {said} (docs/recordings.md tells what it needs)"
