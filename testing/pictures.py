"""Pictures of finished studies for the documentation, taken from their own pages in headless Chromium.

`python -m testing.pictures playing` writes docs/images/playing.webp, a motion of the default study as its page plays
it; `python -m testing.pictures arms` writes docs/arms.md and its pictures, from the pages of config/gallery.yaml.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from selenium.webdriver.chrome.webdriver import WebDriver
from selenium.webdriver.common.by import By

from er3a.pipeline.language import own_title
from er3a.pipeline.study import Study, load_study
from testing import chromium

DOCS = Path(__file__).resolve().parent.parent / "docs"
ROBOT, MOTION = "er3a_c60", "line_collides"
FRAMES, FRAME_MS, WIDTH = 60, 80, 640
ARM_WIDTH = 420
GALLERY = "config/gallery.yaml"


def main() -> None:
    """Write what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("playing", "arms"))
    parser.add_argument("--folder", type=Path, default=Path(), help="where reports are")
    options = parser.parse_args()
    with TemporaryDirectory() as profile:
        browser = chromium.start(Path(profile))
        try:
            if options.what == "playing":
                write_playing(browser, options.folder / "reports")
            else:
                write_arms(browser, load_study(Path(GALLERY)), options.folder)
        finally:
            browser.quit()


def _there(page: Path, study: str) -> Path:
    """A page of a finished study; exits with the command that makes it if it is missing."""
    if not page.is_file():
        raise SystemExit(f"error: {page}: there is no such page; first: .venv/bin/er3a run --study {study}")
    return page.resolve()


def write_playing(browser: WebDriver, reports: Path) -> None:
    """The moving picture of the README: a motion as its page plays it, with what the page says of it."""
    with chromium.emulating(browser, 900, 900, prefers_color_scheme="light"):
        browser.get(_there(reports / ROBOT / "trajectory.html", "config/config.yaml").as_uri())
        stand = browser.find_element(By.CSS_SELECTOR, ".player .stand")
        browser.execute_script("arguments[0].scrollIntoView()", stand)
        frames = []
        for k in range(FRAMES):
            _go_to(browser, MOTION, k / (FRAMES - 1))
            shot = Image.open(io.BytesIO(stand.screenshot_as_png)).convert("RGB")
            frames.append(shot.resize((WIDTH, round(shot.height * WIDTH / shot.width)), Image.Resampling.LANCZOS))
    height = min(frame.height for frame in frames)
    frames = [frame.crop((0, 0, WIDTH, height)) for frame in frames]
    durations = [FRAME_MS] * (FRAMES - 1) + [1500]
    file = DOCS / "images/playing.webp"
    frames[0].save(file, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=60, method=6)


def write_arms(browser: WebDriver, study: Study, folder: Path) -> None:
    """The page on the arms of a study: each in its surroundings, and what it reaches."""
    parts = [
        "# Gallery of arms",
        "Arms of other classes than those of the default study, as `er3a run --study config/gallery.yaml` shows them: "
        "its index has their verdicts. `make pictures` took the pictures from its pages.",
    ]
    for name in study.robots:
        pictures = {"playing": "the arm at the start of a path, as its page plays it", "reach": "what its tool reaches"}
        page = folder / "reports" / name
        _save(_canvas(browser, _there(page / "trajectory.html", GALLERY)), name, "playing")
        _save(_reach(browser, _there(page / "workspace.html", GALLERY)), name, "reach")
        shown = "\n".join(f"![{name}: {what}](images/arms/{name}_{kind}.webp)" for kind, what in pictures.items())
        title = f"## {own_title(study.robot(name).title)}"
        parts += [title, shown]
    (DOCS / "arms.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _go_to(browser: WebDriver, motion: str | None, part: float) -> None:
    """Show a moment of a motion, in parts of its time, and wait until it is drawn."""
    browser.execute_async_script(
        "const [motion, part, done] = arguments;"
        "const [list, bar] = ['.motion', '.time'].map((name) => document.querySelector('.player ' + name));"
        "if (motion && list.value !== motion) {list.value = motion; list.dispatchEvent(new Event('change'));}"
        "requestAnimationFrame(() => requestAnimationFrame(() => {"
        "bar.value = Number(bar.min) + part * (bar.max - bar.min); bar.dispatchEvent(new Event('input'));"
        "requestAnimationFrame(() => requestAnimationFrame(done));}));",
        motion,
        part,
    )


def _canvas(browser: WebDriver, page: Path) -> Image.Image:
    with chromium.emulating(browser, 900, 900, prefers_color_scheme="light"):
        browser.get(page.as_uri())
        canvas = browser.find_element(By.CSS_SELECTOR, ".player canvas")
        browser.execute_script("arguments[0].scrollIntoView()", canvas)
        _go_to(browser, None, 0.0)
        return Image.open(io.BytesIO(canvas.screenshot_as_png)).convert("RGB")


def _reach(browser: WebDriver, page: Path) -> Image.Image:
    with chromium.emulating(browser, 1200, 1000, prefers_color_scheme="light"):
        browser.get(page.as_uri())
        figure = browser.find_element(By.CSS_SELECTOR, "figure img[data-axes]")
        browser.execute_script("arguments[0].scrollIntoView()", figure)
        return Image.open(io.BytesIO(figure.screenshot_as_png)).convert("RGB")


def _save(picture: Image.Image, name: str, kind: str) -> None:
    folder = DOCS / "images/arms"
    folder.mkdir(parents=True, exist_ok=True)
    small = picture.resize((ARM_WIDTH, round(picture.height * ARM_WIDTH / picture.width)), Image.Resampling.LANCZOS)
    small.save(folder / f"{name}_{kind}.webp", quality=75, method=6)


if __name__ == "__main__":
    main()
