"""The pages of the small study, by their path below the reports."""

from tests.conftest import ROBOTS

OVER_ALL = ["index.html", "compare.html"]
STAGE_PAGES = [
    f"{robot}/{stage}.html"
    for robot in ROBOTS
    for stage in ("validation", "workspace", "collision", "inverse", "trajectory", "dynamics")
]
PAGES = OVER_ALL + STAGE_PAGES + [f"{robot}/teach.html" for robot in ROBOTS]
