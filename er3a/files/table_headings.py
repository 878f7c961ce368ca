"""What a column heading of a D-H table means, in the words and signs of books, articles, programs and spreadsheets."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache

from er3a.by_value import frozen
from er3a.files.arithmetic import UNITS, plain, words_of

_JOINT = words_of(
    "joint joints joint# jointi jointno jointno. jointnumber link links link# linki linkno linkno. linknumber axis "
    "i j n no no. # name frame kinematics gelenk achse articulation articulación eslabón junta ジョイント "
    "关节 关节i 关节序号 关节号 连杆 连杆i 连杆序号 轴 序号 杆件"
)
_NAMES = words_of(
    "a=a r=a l=a d=d q=theta v=theta phi=theta φ=theta th=theta teta=theta tetha=theta thetha=theta "
    "tehta=theta tw=alpha alf=alpha alfa=alpha alp=alpha alph=alpha al=alpha offset=offset "
    "offsets=offset relativeoffset=offset theta0=offset θ0=offset th0=offset "
    "θoff=offset thoff=offset thetaoff=offset type=type jointtype=type sigma=type σ=type 类型=type"
)
_WORDS = words_of(
    "零位=offset 零偏=offset thoffset=offset angleoffset=offset thetaoffset=offset offsettheta=offset θoffset=offset "
    "θ,offset=offset theta,offset=offset linklength=a 连杆长=a 杆长=a linkoffset=d jointoffset=d jointdistance=d "
    "偏距=d 偏移=d 偏置=d α=alpha alpha=alpha twist=alpha 扭=alpha θ=theta theta=theta jointangle=theta 关节角=theta "
    "转角=theta β=beta beta=beta"
)
"""Each marks a heading that holds it; the first that is found counts."""
_OURS = re.compile(r"(joint)|(a|alpha|d|offset)_(mm|cm|m|in|deg|rad)")
_PRIVATE = re.compile(r"type|convention|direction|calibrated|(?:lower|upper|speed)_\w+|(?:beta|theta)_(?:deg|rad)")
_OF_RANGES = re.compile(r"(?i)(?<![a-z])(?:min|max|range|limit)|范围|限")
_LETTER = re.compile(r"[^\W\d_]|#")
_LAST_WORD = re.compile(r".*\s([^\s(\[\]]+)\s*(?:[(\[]\D*)?")
_UNIT = re.compile(r"(?:[(\[/,]|(?<=[a-zα-ω])_(?=(?:mm|cm|m|in|deg|rad)$))([^()\[\]/,]+)")
_BEFORE = re.compile(r"[ijn](?:-1|_?m1)")


@frozen
class Heading:
    """``quantity``: joint, theta, d, a, alpha, offset, beta or type; ``unit``: "" where none is printed; ``before``:
    whether it belongs to the link before the joint, as in Craig's tables; ``sign``: the letter that was printed for a
    length."""

    quantity: str
    unit: str
    before: bool
    sign: str = ""


@lru_cache(maxsize=4096)
def heading_of(text: str) -> Heading | None:
    """What a column heading of a D-H table means.

    Parameters
    ----------
    text : such as ``a_mm``, ``α(i-1)``, ``d_i [m]``, ``Link length`` or ``关节角θ(°)``

    Returns
    -------
    heading : None for any other text, and for er3a's own headings of other columns
    """
    if own := _OURS.fullmatch(text):
        return Heading(own[1] or own[2], own[3] or "", False)
    if _PRIVATE.fullmatch(text) or len(text) > 60 or not _LETTER.search(text) or _OF_RANGES.search(text):
        return None
    short = re.sub(r"<[^>]*>|[\s{}\\\"'`$^]", "", plain(text).lower())
    said = [each for each in _UNIT.findall(short) if each in UNITS]
    unit = UNITS[said[0]] if said else ""
    name = re.sub(r"_(mm|cm|m|in|deg|rad)$", "", short)
    # Without the index, which says only whether the entry belongs to the joint or to the link before it.
    name = re.sub(r"[(\[](?!offset|\d)[^()\[\]]*[)\]]|/.*|,(?!offset).*", "", name)
    name = re.sub(r"_?[ijn](?:-1|_?m1)$|(?<=.)_?[ijn]$|\*$|_k$|:$", "", name).replace("_", "")
    if name in _JOINT:
        return Heading("joint", "", False)
    last = _LAST_WORD.fullmatch(plain(text.lower()))
    marked = (
        _NAMES.get(name)
        or next((quantity for mark, quantity in _WORDS.items() if mark in name), None)
        or _NAMES.get(re.sub(r"[^a-z]", "", name) if not name.isascii() else "")
        or _NAMES.get(name.removesuffix("(offset)"))
        or (last and _NAMES.get(last[1]))
    )
    return Heading(marked, unit, bool(_BEFORE.search(short)), name) if marked else None


def quantities_of(names: Iterable[str]) -> list[str]:
    """The quantities of those headings that are a D-H table's."""
    return [found.quantity for name in names if (found := heading_of(name))]


def place_of(name: str) -> str:
    """What a column is, whether theta or its offset."""
    return next(iter(quantities_of([name])), name).replace("offset", "theta")
