"""What the page shows of diagnosis and identification: tables, and figures with their captions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.validation.wording import both_faults, in_a_row, typographic
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.page import Picture, fixed
from er3a.pipeline.viewing.palette import INK, MODEL, MUTED, REFERENCE

SHOWN_HYPOTHESES = 5
SHOWN_RESIDUALS = 12
LEAST_DRAWN = 1e-3


def culprit_stories(summary: dict[str, Any], residuals: pd.DataFrame) -> list[dict[str, Any]]:
    """Per reference set: what the diagnosis says, the next-best hypotheses, and the residuals as a figure."""
    stories = []
    for culprit in summary["culprits"]:
        ranked = [row for row in summary["diagnosis"] if row["reference_set"] == culprit["reference_set"]]
        own = residuals[residuals["reference_set"] == culprit["reference_set"]]
        named = culprit["status"] in ("named", "mostly")
        stories.append(
            culprit
            | {
                "text": typographic(culprit["text"]),
                "alike": [typographic(words) for words in ranked[0]["indistinguishable_from"]] if named else [],
                "to_decide": typographic(ranked[0]["to_decide"]) if named else "",
                "others": [_hypothesis_row(row) for row in ranked[1 if named else 0 : SHOWN_HYPOTHESES]],
                "others_title": tr("Next-best hypotheses")
                if named
                else tr("The best hypotheses, none of which will do"),
                "picture": _residual_picture(own, culprit, ranked),
            }
        )
    return stories


def correction_stories(summary: dict[str, Any], corrections: pd.DataFrame) -> list[dict[str, Any]]:
    """Per reference set: what its positions say about the table's entries, with the figure."""
    stories = []
    for found in summary["identification"]:
        own = corrections[corrections["reference_set"] == found["reference_set"]]
        story = found | {"text": typographic(found["text"]), "picture": None, "rows": []}
        story["close"] = [
            tr("{first} and {second} ({correlation})", first=first, second=second, correlation=fixed(correlation, 2))
            for first, second, correlation in found.get("close", ())
        ]
        if len(own):
            alt = tr(
                "Correction of each identified entry of the table with its 95 % interval, lengths and angles apart."
            )
            story["picture"] = Picture(corrections_figure(own), alt, story["text"])
            story["rows"] = [
                [row.name, fixed(row.nominal, 3), fixed(row.correction, 4), fixed(row.half_width, 4), row.unit]
                for row in own.itertuples(index=False)
            ]
        stories.append(story)
    return stories


def residual_figure(rows: pd.DataFrame) -> Figure:
    """Residuals before and after the best hypothesis, with each reference's uncertainty; worst on top."""
    figure, axes = new_figure(width=9, height=1.5 + 0.32 * len(rows))
    at = np.arange(len(rows))[::-1]
    before, after = (np.maximum(rows[key].to_numpy(), LEAST_DRAWN) for key in ("before", "after"))
    axes.hlines(at, np.minimum(before, after), np.maximum(before, after), color=MUTED, linewidth=1.2)
    axes.plot(before, at, "o", color=REFERENCE, label=tr("table as it is"))
    axes.plot(after, at, "D", color=MODEL, markersize=5, label=tr("with the best hypothesis mended"))
    axes.plot(rows["uncertainty"], at, "|", color=INK, markersize=13, label=tr("uncertainty of the reference"))
    axes.set_xscale("log")
    axes.set_yticks(at, [f"{tr(row.name)} ({row.unit})" for row in rows.itertuples(index=False)])
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlim(LEAST_DRAWN / 1.5, 2 * max(before.max(), after.max()))
    axes.grid(axis="y", visible=False)
    axes.set_xlabel(tr("residual (mm or deg, as named; {least:g} stands for all that is less)", least=LEAST_DRAWN))
    figure.legend(loc="outside upper left", ncols=3)
    return figure


def corrections_figure(rows: pd.DataFrame) -> Figure:
    """Corrections with their 95 % intervals, lengths and angles in panels of their own."""
    units = [unit for unit in ("mm", "deg") if (rows["unit"] == unit).any()]
    counts = [int((rows["unit"] == unit).sum()) for unit in units]
    figure, panels = new_figure(1, len(units), width=9, height=3.4, width_ratios=counts, squeeze=False)
    for axes, unit in zip(panels[0], units):
        own = rows[rows["unit"] == unit]
        at = np.arange(len(own))
        axes.axhline(0, color=MUTED, linewidth=1)
        axes.errorbar(at, own["correction"], own["half_width"], fmt="o", color=MODEL, capsize=4, elinewidth=1.4)
        axes.set_xticks(at, [tr(name) for name in own["name"]], rotation=45 if len(own) > 8 else 0)
        axes.set_xlim(-0.6, len(own) - 0.4)
        axes.set_ylabel(tr("correction ({unit})", unit=unit))
        axes.grid(axis="x", visible=False)
    return figure


def _residual_picture(rows: pd.DataFrame, culprit: dict[str, Any], ranked: list[dict]) -> Picture | None:
    missed = rows[(rows["before"] > rows["uncertainty"]) | (rows["after"] > rows["uncertainty"])]
    if missed.empty:
        return None
    shown = missed.head(SHOWN_RESIDUALS)
    still = int((missed["after"] > missed["uncertainty"]).sum())
    if culprit["status"] == "named":
        caption = tr("Mending the named fault takes every residual below the uncertainty of its reference.")
    elif ranked:
        caption = tr("Even the best hypothesis leaves {still} of {all} references missed.", still=still, all=len(rows))
    else:
        caption = tr("No hypothesis does better than the table as it is.")
    if len(missed) > len(shown):
        more = tr("The {drawn} farthest off of {missed} are drawn.", drawn=len(shown), missed=len(missed))
        caption = in_a_row(caption, more)
    alt = tr("Residual of each missed reference before and after the best hypothesis, on a logarithmic axis.")
    return Picture(residual_figure(shown), alt, caption)


def _hypothesis_row(row: dict[str, Any]) -> list[str]:
    alike = row["indistinguishable_from"]
    words = both_faults(row["faults"])
    if alike:
        words = tr("{faults} (or {more} more that these references can't tell from it)", faults=words, more=len(alike))
    return [words, fixed(row["residual_before"], 1), fixed(row["residual_after"], 1), row["unit"]]
