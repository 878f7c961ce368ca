"""Links of a folder of pages that lead nowhere: to a file or a part of a page that is not in the folder.

python -m testing.links FOLDER        names each, and ends with 1 if there are any
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


@dataclass
class _Page(HTMLParser):
    """Where a page's links lead, and the names of its parts."""

    links: list[str] = field(default_factory=list)
    parts: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.links += [link for name in ("href", "src") if (link := given.get(name))]
        self.parts |= {part for name in ("id", "name") if (part := given.get(name))}


@cache
def _read(path: Path) -> _Page:
    page = _Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def broken_links(folder: Path) -> list[tuple[str, str]]:
    """The pages below a folder and their links to files and parts of pages that are not there; others' sites are not
    looked at, nor is what follows ``#q=``, a state of the teach panel."""
    folder = folder.resolve()
    links = [(page, link) for page in sorted(folder.rglob("*.html")) for link in _read(page).links]
    return [(page.relative_to(folder).as_posix(), link) for page, link in links if _broken(page, link)]


def _broken(page: Path, link: str) -> bool:
    address = urlsplit(link)
    if address.scheme or address.netloc:
        return False
    target = (page.parent / unquote(address.path)).resolve() if address.path else page
    if target.is_dir():
        target /= "index.html"
    if not target.is_file():
        return True
    part = unquote(address.fragment)
    return bool(part) and not part.startswith("q=") and target.suffix == ".html" and part not in _read(target).parts


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Names the links of a folder of pages that lead nowhere.")
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args(words).folder
    broken = broken_links(folder)
    for page, link in broken:
        print(f"{folder / page}: {link} leads nowhere")
    print(f"{len(broken)} broken links in {len(list(folder.rglob('*.html')))} pages")
    return int(bool(broken))


if __name__ == "__main__":
    raise SystemExit(main())
