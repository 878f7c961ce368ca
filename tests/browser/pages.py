"""The pages of the small study, by their path below the reports."""

from testing.small_study import stages_of
from tests.conftest import ROBOTS

OVER_ALL = ["index.html", "compare.html"]
STAGE_PAGES = [f"{robot}/{stage}.html" for robot in ROBOTS for stage in stages_of(robot)]
PAGES = OVER_ALL + STAGE_PAGES + [f"{robot}/teach.html" for robot in ROBOTS]
