"""What the search finds: headings, rows and captions of all pages."""

from __future__ import annotations

import re
from collections.abc import Iterator, Set
from html.parser import HTMLParser
from pathlib import Path

from er3a.pipeline.language import own_title, tr
from er3a.pipeline.messages.say import bracketed, joined
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import PAGES

INLINE = ("sub", "sup", "wbr")  # no blank before or behind
_NOT_READ = re.compile(r'<(script|style)\b.*?</\1>|\ssrc="data:[^"]*"|\sdata-[\w-]+="[^"]*"', re.DOTALL)


class TextOfPage(HTMLParser):
    """Headings, rows and captions of a page's main part, folded or not, in the page's order, by heading."""

    KEPT = ("caption", "figcaption", "h1", "h2", "h3", "li", "summary", "tr")
    NOT_READ = ("svg", "thead")

    def __init__(self) -> None:
        super().__init__()
        self.texts: dict[str, dict[str, None]] = {}
        self._heads = {"h2": "", "h3": ""}
        self._depth = dict.fromkeys(("main", "tr", *self.NOT_READ), 0)
        self._parts = list[str]()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a block or row."""
        self._between(tag)
        if tag in self._depth:
            self._depth[tag] += 1

    def handle_endtag(self, tag: str) -> None:
        """End a block or row; a heading's text is that of what follows."""
        if tag in self._depth:
            self._depth[tag] -= 1
        if tag in self._heads:
            self._heads |= {"h3": ""} | {tag: " ".join("".join(self._parts).split())}
        self._between(tag, ended=True)

    def handle_data(self, data: str) -> None:
        """Take text of the main part, but for what is in ``NOT_READ``."""
        if self._depth["main"] and not any(self._depth[tag] for tag in self.NOT_READ):
            self._parts.append(data)

    def _between(self, tag: str, ended: bool = False) -> None:
        """Where what is kept ends, what came since it began is one text; cells and what is in them stay in their
        row's."""
        if tag not in self.KEPT or self._depth["tr"]:
            self._parts.append("" if tag in INLINE else " ")
            return
        text = " ".join("".join(self._parts).split())
        if ended and len(text) > 1:
            self.texts.setdefault(joined([*filter(None, self._heads.values())], " "), {})[text] = None
        self._parts = []


def places(
    study: Study, folder: Path, contradicted: Set[str]
) -> Iterator[tuple[str, str, list[tuple[str, list[str]]]]]:
    """Of each page that is there its address, its title, and by heading what is searched; a title says which robots'
    tables evidence contradicts."""
    titles = {
        name: bracketed(own_title(study.robot(name).title), tr("never use this table") if name in contradicted else "")
        for name in study.names
    }
    named = {
        f"{name}/{stage}.html": tr("{robot}: {page}", robot=titles[name], page=tr(PAGES[stage]))
        for name in study.names
        for stage in study.pages(name)
    }
    if study.article:
        named["article.html"] = tr("The article, item by item")
    for address, title in named.items():
        if (folder / address).is_file():
            parser = TextOfPage()
            parser.feed(_NOT_READ.sub("", (folder / address).read_text(encoding="utf-8")))
            yield address, title, [(head, list(texts)) for head, texts in parser.texts.items()]
