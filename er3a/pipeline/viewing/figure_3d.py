"""3-D figures that turn in the browser, with all their script inside the page."""

from __future__ import annotations

import base64
import gzip
import json
from functools import cache
from pathlib import Path

import plotly.graph_objects as go
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from er3a.pipeline.messages.language import N_, tr

# As Plotly names its buttons.
WORDS = (
    N_("Download plot as a PNG"),
    N_("Zoom"),
    N_("Pan"),
    N_("Orbital rotation"),
    N_("Turntable rotation"),
    N_("Reset camera to default"),
)


def turning_html(figure: go.Figure) -> Markup:
    """The figure as HTML; one a page. The browser unpacks Plotly and draws when a reader comes near, or prints."""
    shown = figure.to_json().replace("</", "<\\/")
    script = Path(__file__).with_name("turning.js").read_text(encoding="utf-8")
    return Markup(
        '<div id="turning"></div>'
        f'<script type="text/plain" id="plotly">{_packed_plotly()}</script>'
        f'<script type="application/json" id="turning-figure">{shown}</script>'
        f'<script type="application/json" id="turning-words">{json.dumps({word: tr(word) for word in WORDS})}</script>'
        f"<script>{script}</script>"
    )


@cache
def _packed_plotly() -> str:
    return base64.b64encode(gzip.compress(get_plotlyjs().encode("utf-8"), mtime=0)).decode("ascii")
