"""Sound input files that use every optional part, and damaged copies of them."""

from __future__ import annotations

from pathlib import Path
from random import Random

from testing.mutants import mutant

ROOT = Path(__file__).resolve().parents[1]

ALL_OF_A_ROBOT = """
base: {source: fitted, grade: inferred, xyz_mm: [100.5, 0, 50], rpy_deg: [0, 0, 30]}
tool: {source: fitted, grade: inferred, xyz_mm: [0, 12.25, 80], rpy_deg: [10, 20, 40]}
envelopes:
  source: drawn
  grade: inferred
  capsules:
    - {link: 2, from_mm: [0, 0, 0], to_mm: [0, 0, 200], radius_mm: 60}
    - {link: 6, from_mm: [0, 0, 0], to_mm: [5, 0, 40], radius_mm: 30.5}
"""
SCENE = """kind: scene
title: all shapes
boxes:
  - {name: table, xyz_mm: [400, 0, -50], rpy_deg: [0, 0, 12], size_mm: [600, 800, 40]}
cylinders:
  - {name: post, xyz_mm: [300.5, 200, 100], radius_mm: 25, length_mm: 400}
spheres:
  - {name: ball, xyz_mm: [0, -450, 300], radius_mm: 80.25}
planes:
  - {name: floor, normal: [0, 0, 1], offset_mm: -400}
"""
TARGETS = """kind: targets
targets:
  - {name: a, note: by hand, xyz_mm: [400, 0, 300], rpy_deg: [0, 90, 12.5]}
  - {name: b, xyz_mm: [350.25, 100, 300], zyz_deg: [0, 90, 30], q_ref_deg: [0, 10, 0, 0, 45, 0]}
  - {name: c, xyz_mm: [400, 0, 350], quaternion_wxyz: [0.5, 0.5, 0.5, 0.5]}
  - {name: d, xyz_mm: [400, 10, 350], matrix: [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
  - {name: e, q_deg: [10, 20, 30, 40, 50, 60]}
"""
TARGET_TABLE = f"""name,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,note,{",".join(f"q{k}_ref_deg" for k in range(1, 7))}
a,400,0,300.5,0,90,0,first,0,0,0,0,0,0
b,350,100.25,280,10,80,30,,10,20,0,0,45,0
"""
PATH_TABLE = """t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz
0,400,0,300.5,0.5,0.5,0.5,0.5
0.5,400,20,300,0.5,0.5,0.5,0.5
1.25,400,20,320,1,0,0,0
"""
MOTION_TABLE = """q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg
0,0,0,0,0,0
10.5,20,-30,0,45,0
"""
MEASUREMENTS = """q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,point,x_mm,y_mm,z_mm,standard_deviation_mm
0,0,0,0,0,0,flange,329.5,0.25,630,0.1
30,20,-10,40,50,60,flange,210.5,140,,0.1
-30,40,10,20,-50,10,tool,312,-180.75,512,0.2
"""


def seeds() -> list[tuple[str, bytes]]:
    """Sound files, as path (relative) and content: all committed inputs, and ones that use every optional part."""
    paths = [*ROOT.glob("data/**/*.yaml"), *ROOT.glob("config/*.yaml"), *ROOT.glob("data/**/*.csv")]
    paths = [path for path in paths if path.parent.name != "arms"]  # the catalogue is no input
    found = [(path.relative_to(ROOT).as_posix(), path.read_bytes()) for path in sorted(paths)]
    robot = (ROOT / "data/robots/er3a_c60_article.yaml").read_text(encoding="utf-8")
    robot = robot.replace("name: er3a_c60_article", "name: full")
    more = {"full.yaml": robot + ALL_OF_A_ROBOT, "scene.yaml": SCENE, "targets.yaml": TARGETS}
    more |= {"targets/table.csv": TARGET_TABLE, "measured.csv": MEASUREMENTS}
    more |= {"paths/tool.csv": PATH_TABLE, "paths/joints.csv": MOTION_TABLE}
    return found + [(name, text.encode()) for name, text in more.items()]


def mutants(count: int, seed: int) -> list[tuple[str, bytes, str]]:
    """Path, content and what was done to it, of damaged files; the same for the same seed."""
    random, sound = Random(seed), seeds()
    return [(name, *mutant(content, Path(name).suffix, random)) for name, content in (
        sound[n % len(sound)] for n in range(count)
    )]  # fmt: skip
