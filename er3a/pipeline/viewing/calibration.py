"""The page of ``er3a calibrate``: errors before and after over the workspace, entries, terms, the corrected file."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.ticker import MaxNLocator

from er3a.by_value import by_identity
from er3a.calibration.calibrate import Calibration, TermEstimate
from er3a.calibration.cross_validation import HeldOutErrors, TriedTerm
from er3a.calibration.held_back import held_back_findings
from er3a.calibration.observations import Measurement, PointObservations, observed
from er3a.files.kept_files import sha256
from er3a.files.robot_writer import robot_file, robot_text
from er3a.numerics.arrays import Reals
from er3a.pipeline import language
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import N_, as_text, tr, unit_sign
from er3a.pipeline.messages.calibration import (
    VERDICTS,
    file_text,
    idle_texts,
    not_examined_texts,
    term_kind,
    warning_texts,
)
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.messages.say import bracketed, joined, listed, say
from er3a.pipeline.results import Input, Provenance
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.figures import equal_scale, house_style, new_figure
from er3a.pipeline.viewing.page import Picture, ShownFigure
from er3a.robots.robot import Robot

AXES = ("x", "y", "z")
MODELS = {"before": N_("before"), "table": N_("robot file"), "model": N_("with terms")}


@by_identity
class MeasuredErrors:
    """A calibration at the positions that it was made from.

    Attributes
    ----------
    xyz_mm : (P, 3), where the corrected table puts the points
    differences_mm : by ``before``, ``table`` and, if there are terms, ``model``: (P, 3), model minus measurement
    """

    xyz_mm: Reals
    differences_mm: dict[str, Reals]

    def distances_mm(self, model: str) -> Reals:
        """How far a model is off at each measured position.

        Parameters
        ----------
        model : ``before``, ``table`` or ``model``

        Returns
        -------
        distances : (P,), mm; coordinates that were not measured do not count
        """
        found: Reals = np.sqrt(np.nansum(self.differences_mm[model] ** 2, axis=1))
        return found

    @property
    def after(self) -> str:
        """The last of the models."""
        return list(self.differences_mm)[-1]


def measured_errors(robot: Robot, measurements: Sequence[Measurement], found: Calibration) -> MeasuredErrors:
    """Differences between measured positions and models of the arm, before and after a calibration.

    Parameters
    ----------
    robot : with the table before
    measurements : positions from which the calibration was made
    found : the calibration

    Returns
    -------
    errors : mm, by the table before, the corrected one, and the model with terms if there are any
    """
    seen = observed(measurements, robot)
    assert isinstance(seen, PointObservations)
    nothing = found.without_terms()
    by_model = {
        "before": replace(nothing, robot=robot).model.differences_mm(measurements),
        "table": nothing.model.differences_mm(measurements),
    }
    if found.beyond:
        by_model["model"] = found.beyond.differences_mm(measurements)
    return MeasuredErrors(1000 * seen.positions(found.robot), by_model)


def write_calibration(
    robot: Robot,
    measurements: Sequence[Measurement],
    found: Calibration,
    output: Path,
    *,
    command: Sequence[str],
    files: Sequence[Path],
    corrected: Robot,
    held_back: Sequence[Measurement] = (),
) -> None:
    """Render a calibration as a page.

    Parameters
    ----------
    robot : the table that it started from
    command : that made it
    files : what it was made from: the robot's file, if it is no name, and the measurements
    corrected : what the robot file holds, with the file's name
    held_back : positions that the fit has not seen
    """
    errors = measured_errors(robot, measurements, found)
    text = robot_text(robot_file(corrected))
    against = listed(held_back_findings(found, measurements, held_back))
    table = str(files[0]) if len(files) > 1 else robot.name
    with house_style():
        page.render(
            Path(__file__).with_name("calibration.html.j2"),
            output,
            command=shlex.join(command),
            provenance=Provenance(tuple(Input(str(f), sha256(f), {}) for f in files), code_digest()),
            arm=language.own_title(robot.title),
            verdict="fail" if not found.fits else "caution" if against else "pass",
            conclusion=joined([say(found.conclusion), *against], " "),
            texts=_texts(found, held_back),
            figures=_figures(found, errors),
            errors=_errors(found, errors, held_back),
            entries=_entries(found),
            held=[say(why) for why in found.held],
            outliers=[(str(each.row), number(each.distance_mm, 3)) for each in found.outliers],
            tried=_tried(found.tried, found.beyond.terms if found.beyond else found.ratios),
            compare_command=shlex.join(["er3a", "compare", table, f"{corrected.name}.yaml", "--html", "compared.html"]),
            corrected=text,
            without_terms=file_text(found),
            corrected_name=f"{corrected.name}.yaml",
            corrected_address=page.text_address(text),
            maps=_maps(errors),
        )


def _texts(found: Calibration, held_back: Sequence[Measurement]) -> list[str]:
    texts = [
        tr(
            "{settled} of {all} numbers are settled by {coordinates} coordinates at {poses} poses.",
            settled=len(found.estimates) - len(found.open),
            all=len(found.estimates) + len(found.held),
            coordinates=found.coordinates,
            poses=found.poses,
        ),
        *warning_texts(found),
        *idle_texts(found),
    ]
    if found.more:
        texts.append(say(found.more))
    return texts + [tr("Not examined: {what}.", what=each) for each in not_examined_texts(found, held_back)]


def _figures(found: Calibration, errors: MeasuredErrors) -> list[ShownFigure]:
    left_out = found.beyond.left_out if found.beyond else found.left_out
    figures = [
        (tr("before, mean distance"), float(errors.distances_mm("before").mean())),
        (tr("after, mean distance"), float(errors.distances_mm(errors.after).mean())),
    ]
    if left_out:
        figures.append((tr("at poses left out, mean"), left_out.mean_mm))
        figures.append((tr("at poses left out, worst"), left_out.worst_mm))
    by_model = {"model": found.beyond.deviation_mm if found.beyond else None, "table": found.deviation_mm}
    for model, deviation in by_model.items():
        if deviation is not None:
            label = tr("standard deviation of a coordinate, estimated: {model}", model=tr(MODELS[model]))
            figures.append((label, deviation))
    return [ShownFigure(label, label, value, "mm", None, "mm") for label, value in figures]


def _errors(found: Calibration, errors: MeasuredErrors, held_back: Sequence[Measurement]) -> list[list[str]]:
    left_out: dict[str, HeldOutErrors | None] = {
        "table": found.left_out,
        "model": found.beyond.left_out if found.beyond else None,
    }
    rows = []
    for model in errors.differences_mm:
        rms, own = float(np.sqrt((errors.distances_mm(model) ** 2).mean())), left_out.get(model)
        numbers = () if own is None else (own.mean_mm, own.worst_mm, own.far_mean_mm, own.far_worst_mm)
        rows.append([tr(MODELS[model]), number(rms, 3), *(number(value, 3) for value in numbers or [None] * 4)])
    for model in list(errors.differences_mm)[1:] if held_back else ():
        off = (found if model == "model" else found.without_terms()).distances_mm(held_back)
        title = tr("held back: {count} positions, {model}", count=len(off), model=tr(MODELS[model]))
        rows.append([title, "–", number(float(off.mean()), 3), number(float(off.max()), 3), "–", "–"])
    return rows


def _entries(found: Calibration) -> list[list[str]]:
    return [
        [
            each.name,
            fixed(each.nominal, 4),
            fixed(each.correction, 4),
            fixed(each.half_width, 4),
            fixed(each.nominal + each.correction, 4),
            unit_sign(each.unit),
        ]
        for each in found.estimates
    ]


def _tried(tried: Sequence[TriedTerm], terms: Sequence[TermEstimate]) -> list[list[str]]:
    taken = {(each.kind, each.joint, each.turns, each.by): each for each in terms}

    def row(each: TriedTerm) -> list[str]:
        term = taken.get((each.kind, each.joint, each.turns, each.by)) if each.verdict == "taken" else None
        changes = (as_text(value, "+.1%") for value in (each.change, each.far_change))
        p, result = number(each.probability, 2), tr(VERDICTS[each.verdict])
        return [f"J{each.joint}", term_kind(each), *changes, p, result, _coefficients(term) if term else "–"]

    return [row(each) for each in tried]


def _coefficients(term: TermEstimate) -> str:
    pairs = zip(term.coefficients, term.standard_errors)
    return ", ".join(f"{as_text(value, '+.3f')} ± {1.96 * error:.3f}" for value, error in pairs)


def _maps(errors: MeasuredErrors) -> Picture:
    """Distances over the workspace: from above and in the section through the first axis, a column for each model."""
    models = list(errors.differences_mm)
    figure, axes = new_figure(2, len(models), width=4.2 * len(models), height=7.5, squeeze=False)
    x, y, z = errors.xyz_mm.T
    views = (
        (x, y, bracketed("x", "mm"), bracketed("y", "mm")),
        (np.hypot(x, y), z, bracketed(tr("distance from the base's axis"), "mm"), bracketed("z", "mm")),
    )
    for column, model in enumerate(models):
        distance = errors.distances_mm(model)
        order, top = np.argsort(distance), float(distance.max()) or 1.0
        for row, (across, up, x_label, y_label) in enumerate(views):
            ax = axes[row, column]
            drawn = ax.scatter(
                across[order], up[order], c=distance[order], s=14, cmap="viridis_r", vmin=0, vmax=top, rasterized=True
            )
            equal_scale(ax, x_label, y_label)
        axes[0, column].set_title(tr(MODELS[model]))
        label = bracketed(tr("distance"), "mm")
        figure.colorbar(drawn, ax=axes[:, column], location="bottom", label=label, ticks=MaxNLocator(4))
    caption = tr("Error over the workspace: above from above, below in the section through the base's axis; each "
                 "column has its own scale.")  # fmt: skip
    return Picture(figure, tr("Points of the workspace, coloured by their error before and after"), caption)
