"""Every page in a real browser: no console error, every image loaded, nothing wider than the window."""

from __future__ import annotations

import pytest

PAGES = ["index.html"] + [
    f"{robot}/{stage}.html"
    for robot in ("er3a_c60", "er3a_c60_article", "er3_600")
    for stage in ("validation", "workspace", "inverse", "trajectory", "teach")
]


@pytest.mark.parametrize("page", PAGES)
def test_page_opens_clean(browser, small_study, page):
    path = small_study.folder / "reports" / page
    browser.get(path.as_uri())
    assert "er3a" in browser.title
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    images = browser.execute_script("return [...document.images].map(i => [i.alt, i.complete && i.naturalWidth > 0])")
    assert all(loaded for _, loaded in images)
    assert all(alt for alt, _ in images)
    figures = browser.execute_script("return document.querySelectorAll('figure, canvas').length")
    assert page == "index.html" or figures, "a page shows at least one figure"
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    assert 'src="http' not in path.read_text(encoding="utf-8")


def test_index_leads_to_every_page(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    links = browser.execute_script("return [...document.querySelectorAll('tbody a')].map(a => a.href)")
    found = {link.rsplit("/", 2)[-2] + "/" + link.rsplit("/", 1)[-1] for link in links}
    assert found == set(PAGES) - {"index.html"}
