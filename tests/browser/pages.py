"""The pages of the small study, by their path below the reports."""

from testing.small_study import stages_of
from tests.conftest import ROBOTS

OVER_ALL = ["index.html"]
STAGE_PAGES = [f"{robot}/{stage}.html" for robot in ROBOTS for stage in stages_of(robot)]
PAGES = OVER_ALL + STAGE_PAGES + [f"{robot}/teach.html" for robot in ROBOTS]

STAGE_PAGES_OF_EACH_KIND = [
    *(page for page in STAGE_PAGES if page.startswith("er3a_c60/")),
    "er3a_c60_article/validation.html",  # of a table that evidence contradicts
]
PAGES_WITH_SORTED_TABLES = [*OVER_ALL, *STAGE_PAGES_OF_EACH_KIND]
PAGES_OF_EACH_KIND = [*PAGES_WITH_SORTED_TABLES, "er3a_c60/teach.html"]
PAGES_WITH_EACH_CONTROL = [*OVER_ALL, "er3a_c60/validation.html", "er3a_c60/trajectory.html", "er3a_c60/teach.html"]
