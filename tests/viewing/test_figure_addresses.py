"""Figures as addresses in a page: the picture that matplotlib writes, in fewer letters."""

from __future__ import annotations

import io
import re
import xml.etree.ElementTree as ET
from urllib.parse import unquote

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_svg import FigureCanvasSVG

from er3a.pipeline.viewing.figures import STYLE, new_figure, svg_data_uri

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def drawn():
    figure, axes = new_figure()
    x = np.linspace(0, 7, 301)
    axes.plot(x, np.sin(x), label="sin, 5 % & \"more\" < 'less' #1")
    axes.scatter(x[::30], np.cos(x[::30]))
    axes.fill_between(x, -1, np.cos(x))
    axes.set_xlabel("时间 (s)")
    axes.legend()
    return figure


@pytest.mark.parametrize("letters", ["path", "none"])
@pytest.mark.filterwarnings("ignore:Glyph")
def test_an_address_holds_the_picture_that_was_drawn(letters):
    with matplotlib.rc_context(STYLE | {"svg.fonttype": letters}):
        figure = drawn()
        address = svg_data_uri(figure)
        buffer = io.BytesIO()
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})
    kind, _, text = address.partition(",")
    assert kind == "data:image/svg+xml"
    assert not set(text) & set('"<>&#\n')
    assert len(address) < len(buffer.getvalue())
    found, plain = ET.fromstring(unquote(text)), ET.fromstring(buffer.getvalue())
    pairs = list(zip(found.iter(), plain.iter(), strict=True))
    assert len(pairs) > 100
    for own, other in pairs:
        assert own.tag == other.tag
        assert (own.text or "").strip() == (other.text or "").strip()
        assert own.attrib.keys() == other.attrib.keys()
        for key, value in own.attrib.items():
            if key in ("d", "x", "y"):
                numbers = [np.array(NUMBER.findall(each), float) for each in (value, other.attrib[key])]
                np.testing.assert_allclose(*numbers, rtol=0, atol=0.051)
                shapes = [NUMBER.sub("", each).split() for each in (value, other.attrib[key])]
                assert "".join(shapes[0]) == "".join(shapes[1])
            else:
                assert value.replace(" ", "") == other.attrib[key].replace(" ", "")
