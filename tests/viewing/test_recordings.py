"""Every recording is sound, holds what its documentation lists, and has a picture of the arm."""

from __future__ import annotations

import base64
import colorsys
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rerun.chunk import RrdReader

from er3a.collision.scene import Scene, Sphere
from er3a.files.robot_library import load_robot
from er3a.pipeline.player.motions import Mark, PlayedEvent
from er3a.pipeline.results import check_checksum
from er3a.pipeline.study import STAGES
from er3a.pipeline.viewing.arm import LABEL, TIMELINE
from er3a.pipeline.viewing.palette import JOINTS, legible, rgb
from er3a.pipeline.viewing.recording import Curves, Recorded, Run, write_recording
from testing.arms import gantry, scara
from testing.small_study import stages_of
from tests.conftest import ROBOT, ROBOTS, ROOT
from tests.viewing.pictures import joints_seen

RERUN = Path(sys.executable).with_name("rerun")
RECORDINGS = [f"{robot}/{stage}.rrd" for robot in ROBOTS for stage in stages_of(robot)]
ROW = re.compile(r"^\| `(/[^`]*)` \| [^|]+ \| [^|]* \| (\w+) \|$", flags=re.MULTILINE)


@cache
def documented() -> dict[str, str]:
    """The documentation's paths, each with its stage or ``all``."""
    return dict(ROW.findall((ROOT / "docs/recordings.md").read_text(encoding="utf-8")))


def logged(path: Path) -> set[str]:
    return {column.entity_path for column in RrdReader(path).stream().collect().schema().component_columns()}


def rows_for(entity: str, stage: str) -> list[str]:
    """Which rows of the table speak of an entity in a stage's recording."""
    names = {row: re.sub("<[a-z]+>", "[^/]+", row) for row, of in documented().items() if of in ("all", stage)}
    return [row for row, pattern in names.items() if re.fullmatch(pattern, entity)]


@pytest.mark.parametrize("stage", STAGES)
def test_recording_is_sound(small_study, stage):
    path = small_study.folder / f"reports/{ROBOT}/{stage}.rrd"
    assert subprocess.run([RERUN, "rrd", "verify", path], capture_output=True, check=False).returncode == 0
    assert "BlueprintActivationCommand" in subprocess.run(
        [RERUN, "rrd", "print", path], capture_output=True, text=True, check=True
    ).stdout  # fmt: skip


@pytest.mark.parametrize(
    ("arm", "titles"),
    [
        (lambda: load_robot(ROBOT), ("Joint velocity (°/s)", "Joint angle (°)")),
        (scara, ("Velocity (°/s, J3: mm/s)", "Angle (°, J3: mm)")),
        (gantry, ("Joint velocity (mm/s)", "Joint position (mm)")),
    ],
)
def test_curves_of_joints_name_the_unit_of_each(arm, titles):
    robot = arm()
    assert Curves.of_joints(robot, "velocity", "velocity", "/s").title == titles[0]
    assert Curves.of_joints(robot, "angle", "angle").title == titles[1]


@pytest.mark.parametrize("recording", RECORDINGS)
def test_each_entity_is_in_the_documentation_once(small_study, recording):
    stage = Path(recording).stem
    entities = logged(small_study.folder / "reports" / recording)
    assert {f"/{stage}/note", "/arm/link_6/axis", "/arm/tool"} <= entities
    assert {entity: len(rows_for(entity, stage)) for entity in entities} == dict.fromkeys(entities, 1)


@pytest.mark.long
def test_each_documented_entity_is_logged(small_study):
    found = {
        row
        for recording in RECORDINGS
        for entity in logged(small_study.folder / "reports" / recording)
        for row in rows_for(entity, Path(recording).stem)
    }
    assert set(documented()) - found == set()


@pytest.mark.parametrize("stage", ["inverse", "trajectory", "vision"])
def test_the_study_s_scene_is_drawn(small_study, stage):
    entities = logged(small_study.folder / f"reports/{ROBOT}/{stage}.rrd")
    scene = {"table", "post", "lamp", "floor"}
    assert {f"/{stage}/scene/{solid}" for solid in scene} <= entities


def test_recordings_of_a_robot_merge_without_being_mixed(small_study, tmp_path):
    parts = [small_study.folder / f"reports/er3_600/{stage}.rrd" for stage in STAGES]
    subprocess.run([RERUN, "rrd", "merge", *parts, "-o", tmp_path / "all.rrd"], check=True, capture_output=True)
    kept = RrdReader(tmp_path / "all.rrd").recordings()
    assert sorted(recording.application_id for recording in kept) == sorted(f"{stage} er3_600" for stage in STAGES)


@pytest.mark.long
def test_bodies_are_red_and_the_contact_marked_while_they_overlap(robot, tmp_path):
    post = Sphere("post", np.eye(4), 0.1)
    overlap = PlayedEvent(0.5, 0.8, "collision", "fail", ("link_2", "post"))
    contact = Mark(0.5, 0.8, (0.1, 0.2, 0.3), (0.1, 0.2, 0.3), "first contact")
    fast = [PlayedEvent(t, t + 0.1, f"too fast: J{joint}", "caution") for t, joint in ((0.1, 1), (0.15, 2), (0.3, 1))]
    events = [overlap, *fast]
    run = Run("into it", "It goes.", np.linspace(0, 1, 11), np.zeros((11, 6)), events, [contact], outcome="collides")
    shown = Recorded(robot, "arm", "trajectory", "Look.", [run], scene=Scene("a post", (post,)))
    write_recording(shown, tmp_path / "out.rrd")
    rows = RrdReader(tmp_path / "out.rrd").stream().collect().reader(index=TIMELINE).to_pandas()
    times = rows[TIMELINE].dt.total_seconds().to_numpy()

    def changes(entity: str) -> list[tuple[float, bool]]:
        """When something is seen there from then on, and when nothing."""
        column = next(column for column in rows.columns if re.match(rf"{entity}[:/].*:colors", column))
        known = rows[column].notna()
        return list(zip(times[known], (len(colours) > 0 for colours in rows[column][known]), strict=True))

    for entity in ("/arm/link_2/touching", "/trajectory/scene/post/touching", "/trajectory/nearest"):
        assert changes(entity) == [(0.5, True), (0.8, False)], entity
    assert not [column for column in rows.columns if "link_3/touching" in column]
    texts = [text[0] for text in rows["/trajectory/events:TextLog:text"].dropna()]
    told = ["0.100 s: too fast: J1 (0.100", "0.300 s: too fast: J1 (0.300", "0.500 s: collision (0.500"]
    assert texts == ["0.000 s: into it: collides", *(f"{each} s into it)" for each in told)]


@pytest.mark.parametrize("recording", RECORDINGS)
def test_the_picture_shows_the_arm_and_a_page_without_a_player_shows_the_picture(small_study, recording):
    picture = (small_study.folder / "reports" / recording).with_suffix(".webp")
    check_checksum(picture)
    content, page = picture.read_bytes(), picture.with_suffix(".html").read_text(encoding="utf-8")
    assert len(content) < 60_000
    assert joints_seen(content) >= 4
    assert base64.b64encode(content).decode("ascii") in page or 'id="player"' in page


def red(picture: Path) -> int:
    """Pixels in the colour of bodies that touch, as they are lit; a joint's orange has less blue than green."""
    r, g, b, opaque = np.moveaxis(np.asarray(Image.open(picture).convert("RGBA")).astype(int), -1, 0)
    return int(((r > 150) & (g < 80) & (g - b < 30) & (opaque == 255)).sum())


@pytest.mark.long
def test_the_picture_is_of_the_gravest_fault_and_the_same_each_time(robot, tmp_path):
    post = Sphere("post", np.eye(4), 0.3)
    q = np.linspace(0.0, 0.5, 11)[:, None] * np.ones(6)
    q[0] = np.nan  # the arm is nowhere at first
    events = [PlayedEvent(0.2, 0.3, "too fast", "caution"), PlayedEvent(0.5, 0.8, "collision", "fail", ("post",))]
    runs = [Run("good", "", np.zeros(1), q[5:6]), Run("bad", "", np.linspace(0, 1, 11), q, events)]
    for name, shown in (("bad", runs), ("again", runs), ("good", runs[:1])):
        held = Recorded(robot, "arm", "trajectory", "Look.", shown, scene=Scene("a post", (post,)))
        write_recording(held, tmp_path / f"{name}.rrd")
    bad, again, good = (tmp_path / f"{name}.webp" for name in ("bad", "again", "good"))
    assert bad.read_bytes() == again.read_bytes()
    assert red(bad) > red(good) + 500  # a joint's orange has a few pixels as red


def luminance(colour: tuple[int, int, int]) -> float:
    """Relative luminance of an sRGB colour, as WCAG 2 defines it."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (value / 255 for value in colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("ground", [(13, 16, 17), (255, 255, 255)])  # of the viewer's two themes
@pytest.mark.parametrize("label", [LABEL, *map(legible, JOINTS)])
def test_labels_are_legible_on_dark_and_light_ground(label, ground):
    darker, lighter = sorted((luminance(label), luminance(ground)))
    assert (lighter + 0.05) / (darker + 0.05) > 4.2  # no colour has more than 4.4 on both


def test_labels_keep_the_hue_of_their_joint():
    def hue(colour):
        return 255 * colorsys.rgb_to_hsv(*(part / 255 for part in colour))[0]

    assert [hue(legible(colour)) for colour in JOINTS] == pytest.approx([hue(rgb(each)) for each in JOINTS], abs=8)
