"""Stills: what a page shows without WebGL is the same every time, near over far, with marked bodies in their colour."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from er3a.collision.shapes import arm_shapes
from er3a.files.robot_library import load_robot
from er3a.pipeline.player.motions import PlayedEvent, PlayedMotion
from er3a.pipeline.player.player import player
from er3a.pipeline.viewing.drawn import drawn_arm
from er3a.pipeline.viewing.still import HEIGHT, WIDTH, Still
from testing.arms import make_arm

LARGEST = 60_000  # bytes


def pixels(markup: str) -> np.ndarray:
    source = re.search(r'src="data:image/webp;base64,([^"]+)"', str(markup))[1]
    content = base64.b64decode(source)
    assert len(content) < LARGEST
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGBA")).astype(int)


def ball(frame: int, radius: float, x: float, colour: str) -> dict:
    T = np.eye(4)
    T[0, 3] = x
    return {"frame": frame, "name": colour, "kind": "sphere", "radius": radius, "T": T.tolist(), "colour": colour}


@pytest.mark.long
def test_what_is_near_covers_what_is_far_and_lies_where_perspective_puts_it():
    """A ball of radius r at distance d ends r / sqrt(d^2 - r^2) from the middle, in focal lengths."""
    near, far = ball(0, 0.2, 1.0, "#0000ff"), ball(0, 0.9, -1.0, "#ff0000")
    for order in ((near, far), (far, near)):
        picture = Still(np.zeros(3), 1.0, azimuth=0.0, elevation=0.0)
        picture.solids(order, np.eye(4)[None], {})
        shown = pixels(picture.markup())
        blue = shown[HEIGHT // 2, :, 2] > shown[HEIGHT // 2, :, 0] + 40
        distance = 3.7 - 1.0
        expected = 2 * 1.9 * HEIGHT * 0.2 / np.sqrt(distance**2 - 0.2**2)
        assert abs(blue.sum() - expected) < 4
        assert shown[0, 0, 3] == 0
        assert shown[HEIGHT // 2, WIDTH // 2 + 120, 0] > 100  # red around it


@pytest.mark.long
def test_a_player_has_one_that_is_the_same_each_time_and_shows_the_contact():
    robot = load_robot("er3a_c60")
    q = np.zeros((20, 6))
    event = PlayedEvent(0.5, 0.7, "collision", "fail", ("link_2", "post"))
    motion = PlayedMotion("path", "", np.linspace(0.0, 1.0, 20), q, [event])
    once, again = (pixels(player(robot, [motion])) for _ in range(2))
    assert np.array_equal(once, again)
    red = (once[..., 0] > 150) & (once[..., 1] < 80) & (once[..., 3] == 255)
    assert red.sum() > 500


def test_an_arm_is_drawn_as_the_capsules_that_collisions_are_measured_with():
    robot = make_arm()
    shapes = [each for each in drawn_arm(robot)["looks"]["checked"] if each["kind"] == "capsule"]
    assert {(c.link, round(c.radius, 9)) for c in arm_shapes(robot).capsules} <= {
        (each["frame"], round(each["radius"], 9)) for each in shapes
    }
