"""What one takes in at a glance: the first screen, and how much there is to be read in all."""

from __future__ import annotations

import pytest

from testing import chromium
from tests.browser.pages import OVER_ALL, PAGES, STAGE_PAGES

pytestmark = pytest.mark.long

WIDTH, HEIGHT = 1400, 1000
HEADLINE, READ = 12, 40  # words of the verdict, and in runs of eight or more on the first screen
PICTURE = {"index.html": 0.3}  # of the first screen, at least
USUAL_PICTURE = 0.4
VISIBLE, UNFOLDED = 9000, 32_000  # words of all pages

MEASURES = """
const seen = (element) => element.checkVisibility({ checkOpacity: true, checkVisibilityCSS: true });
const count = (text) => (text.trim().match(/\\S+/g) ?? []).length;
function words(screen) {
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const found = { all: 0, runs: 0 };
  while (texts.nextNode()) {
    const text = texts.currentNode;
    if (text.parentElement.closest("script, style, noscript, .listing, .tip") || !seen(text.parentElement)) continue;
    const range = document.createRange();
    range.selectNodeContents(text);
    const box = range.getBoundingClientRect();
    if (screen && (box.top >= innerHeight || box.bottom <= 0 || !box.width)) continue;
    found.all += count(text.data);
    if (count(text.data) >= 8) found.runs += count(text.data);
  }
  return found;
}
let drawn = 0;
for (const picture of document.querySelectorAll("img, canvas, svg")) {
  if (!seen(picture)) continue;
  const box = picture.getBoundingClientRect();
  const shown = (from, to, end) => Math.max(0, Math.min(to, end) - Math.max(from, 0));
  drawn += shown(box.left, box.right, innerWidth) * shown(box.top, box.bottom, innerHeight);
}
const first = words(true), all = words(false);
for (const fold of document.querySelectorAll("details")) fold.open = true;
const headline = count(document.querySelector("h1").innerText);
const picture = drawn / (innerWidth * innerHeight);
return { headline, read: first.runs, picture, visible: all.all, unfolded: words(false).all };
"""


@pytest.fixture(scope="module")
def measured(browser, small_study):
    """The measures of each page by its name."""
    found = {}
    with chromium.emulating(browser, WIDTH, HEIGHT):
        for page in PAGES:
            browser.get((small_study.folder / "reports" / page).as_uri())
            found[page] = browser.execute_script(MEASURES)
    return found


@pytest.mark.parametrize("page", [*OVER_ALL, *STAGE_PAGES])
def test_the_first_screen_shows_a_verdict_and_a_picture(measured, page):
    own = measured[page]
    assert own["headline"] <= HEADLINE
    assert own["read"] <= READ
    assert own["picture"] >= PICTURE.get(page.rsplit("/", 1)[-1], USUAL_PICTURE)


def test_the_answers_of_the_index_are_whole_on_the_first_screen(browser, small_study):
    with chromium.emulating(browser, WIDTH, HEIGHT):
        browser.get((small_study.folder / "reports/index.html").as_uri())
        end = browser.execute_script("return document.querySelector('.tiles').getBoundingClientRect().bottom")
        cut = (
            "return [...document.querySelectorAll('.tile small')].filter((each) => each.scrollWidth > each.clientWidth)"
        )
        assert end <= HEIGHT
        assert not browser.execute_script(cut)


def test_all_pages_together_can_be_read(measured):
    assert sum(own["visible"] for own in measured.values()) <= VISIBLE
    assert sum(own["unfolded"] for own in measured.values()) <= UNFOLDED
