"""Two separate statements about a table: it does not describe the robot of other documents; it contradicts its own
text.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import frozen
from er3a.comparison.compare import shift_between, turn_between, worst_poses
from er3a.diagnosis.diagnose import Diagnosis, diagnosis_of
from er3a.diagnosis.faults import SIDES, entry_of
from er3a.diagnosis.ranking import usable
from er3a.finding import Finding, fact, is_one
from er3a.identifiability.entries import continuous_of, document_of, entries_of
from er3a.identifiability.feasible import MET
from er3a.identifiability.reactions import reactions
from er3a.identifiability.requirements import Asked, requirements_of
from er3a.kinematics.table_batch import Tables, frames_of, join, tables_of
from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.quantities import MM, Extreme
from er3a.references.reference import Documents, Reference, ReferenceSet, conflicts
from er3a.robots.robot import Robot


def diagnose(robot: Robot, references: Sequence[Reference]) -> Diagnosis:
    """Hypotheses about what is wrong with a table, best first.

    Parameters
    ----------
    robot : the table as given, tool not considered (references concern the flange)
    references : official, CAD and export data count, if there are any, else claims do

    Returns
    -------
    ranked : at most 10, those that explain first; empty if the references are met, or if no one or two faults do better
        than the table as it is. What it could not examine is in ``not_examined``, and extremes over the limits that
        the table misses in ``missed``
    """
    found = diagnosis_of(robot, references)
    moving = [entry for entry in entries_of(robot) if entry.column not in (*SIDES, "speed")]
    reacts = reactions(robot, usable(references), moving)
    found.not_examined = tuple(entry.name for k, entry in enumerate(moving) if not reacts[:, k].any())
    extremes = [each for each in references if isinstance(each.quantity, Extreme)]
    extremes = [each for each in extremes if each.is_authoritative] or extremes
    asked = Asked(robot, requirements_of(extremes))
    if len(asked) and (robot.lower <= robot.upper).all():
        off = asked.violation(asked.off(tables_of(robot)))
        found.missed = tuple(extremes[i] for each, by in zip(asked.order, off) if by > MET for i in each.references)
    return found


def is_another_arm(failed: int, total: int, conclusion: Finding | None) -> bool:
    """Whether references describe another arm than a table: most of them are missed, and nothing explains it.

    Parameters
    ----------
    failed, total : checks
    conclusion : of a diagnosis; None without one

    Returns
    -------
    another : False without a diagnosis
    """
    return failed > total / 2 and is_one(conclusion, "no_fault_stands_out", "unexplained")


def not_the_robot_described(robot: Robot, references: ReferenceSet, conclusion: Finding | None) -> Finding | None:
    """Whether trusted documents of another origin describe another robot.

    Parameters
    ----------
    references : of which those count that a diagnosis rests on and that were not made from the table
    conclusion : of the diagnosis

    Returns
    -------
    statement : lengths in mm; None if they don't, or if a correction or two would make it theirs
    """
    documents = dict.fromkeys(reference.document for reference in usable(references) if reference.is_authoritative)
    foreign = [each for each in documents if not made_from_table(robot, each, references.documents)]
    if not (foreign and is_one(conclusion, "unexplained") and conclusion.unit == "mm"):
        return None
    return fact(
        "not_the_robot_described",
        against=tuple(dict.fromkeys(title_of(each, references.documents) for each in foreign)),
        mismatch_mm=conclusion.residual_before,
        left_mm=conclusion.least,
        tried=conclusion.tried,
    )


def inconsistent_with_own_text(robot: Robot, references: ReferenceSet) -> Finding | None:
    """Whether a table misses what its own publisher claims in other words.

    Parameters
    ----------
    references : of which claims of the table's own text count, unless they contradict each other

    Returns
    -------
    statement : with the one entry that would mend it, in its unit; None if the table misses none, or nothing is claimed
    """
    stated = references.checkable
    contested = {i for pair in conflicts(stated) for i in pair}
    own = [
        reference
        for i, reference in enumerate(stated)
        if i not in contested and not reference.is_authoritative and _own_text(robot, reference, references.documents)
    ]
    asked = Asked(robot, requirements_of(own))
    if not len(asked):
        return None
    missed = int((asked.violation(asked.off(tables_of(robot))) > MET).sum())
    if not missed:
        return None
    found = fact(
        "inconsistent_with_own_text",
        entry=None,
        given=None,
        needed=None,
        unit="",
        against=tuple(dict.fromkeys(title_of(reference.document, references.documents) for reference in own)),
        missed=missed,
    )
    by_name = {entry.name: entry for entry in entries_of(robot)}
    for each in diagnosis_of(robot, own):
        entry = by_name.get(entry_of(each.faults[0]) or "") if len(each.faults) == 1 else None
        if entry and asked.missed_by(tables_of(each.corrected)) <= MET:
            given, needed = (entry.value(arm) for arm in (robot, each.corrected))
            return found.but(entry=entry.name, given=given, needed=needed, unit=entry.unit)
    return found


def _documents_of(robot: Robot) -> Sequence[str]:
    """Those that lengths, twists and offsets were taken from."""
    return tuple(dict.fromkeys(document_of(robot, entry) for entry in continuous_of(robot)))


def _own_text(robot: Robot, reference: Reference, documents: Documents) -> bool:
    """Whether a reference is of the table's publisher, and made neither from the table nor with it."""
    tables = _documents_of(robot)
    related = any(documents.same_publisher(reference.document, own) for own in tables)
    return related and not made_from_table(robot, reference.document, documents)


def title_of(document: str, documents: Documents) -> str:
    """A document's title.

    Parameters
    ----------
    document : its name

    Returns
    -------
    title : the name itself if none is known
    """
    return documents.by_name[document].title if document in documents.by_name else document


def made_from_table(robot: Robot, document: str, documents: Documents) -> bool:
    """Whether a document is one that a table's geometry was taken from, or that was made from one of these.

    Parameters
    ----------
    document : its name
    documents : which say what is independent of what

    Returns
    -------
    made : True if it is not independent of any document of the table
    """
    return not all(documents.independent(document, own) for own in _documents_of(robot))


SAME_MM, SAME_DEG = 1e-6, 1e-7
SEEN_AT = 12  # joint vectors, at which the tools of tables are compared


@frozen
class ToolOff:
    """How far the tool is off at most: position and orientation, each at its own worst pose."""

    mm: float
    deg: float

    @property
    def moves(self) -> bool:
        """Whether it is off at all."""
        return self.mm > SAME_MM or self.deg > SAME_DEG

    def within(self, mm: float, deg: float) -> bool:
        """Whether the tool stays below a tolerance.

        Parameters
        ----------
        mm, deg : of position and orientation

        Returns
        -------
        within : both are less
        """
        return self.mm < mm and self.deg < deg

    def worse(self, other: ToolOff) -> ToolOff:
        """The worse of both, in position and in orientation.

        Parameters
        ----------
        other : of another table

        Returns
        -------
        off : mm and deg
        """
        return ToolOff(max(self.mm, other.mm), max(self.deg, other.deg))


NOT_OFF = ToolOff(0.0, 0.0)


class ToolRange:
    """A robot's tool over its joint ranges."""

    def __init__(self, robot: Robot, table: Tables):
        self.robot, self.table = robot, table
        self.lower, self.upper = np.minimum(robot.lower, robot.upper), np.maximum(robot.lower, robot.upper)

    def off(self, other: Tables) -> ToolOff:
        """How far the tool of another table is off at most over the joint ranges.

        Parameters
        ----------
        other : a batch of one

        Returns
        -------
        off : mm and deg, each at its own worst pose; the largest that was found, not proven
        """
        both = join([self.table, other])

        def tools(q: Reals) -> tuple[Reals, Reals]:
            one, there = self._tool(both, q)
            return one, there

        mm, rad = (worst_poses(off, tools, self.robot)[0][0] for off in (shift_between, turn_between))
        return ToolOff(MM * mm, float(np.degrees(rad)))

    def signature(self, tables: Tables) -> Reals:
        """Numbers that are equal for tables whose tools move alike.

        Parameters
        ----------
        tables : H of them

        Returns
        -------
        signature : (H, k), positions in mm and entries of rotations in thousandths, at fixed poses
        """
        q = quasi_random_points(self.lower, self.upper, SEEN_AT)
        T = self._tool(tables, q)
        return np.concatenate([T[..., :3, 3] * MM, T[..., :3, :3].reshape(*T.shape[:2], 9) * MM], axis=-1).reshape(
            len(tables), -1
        )

    def _tool(self, tables: Tables, q: Reals) -> Reals:
        return frames_of(tables, self.robot, q)[:, :, -1] @ self.robot.tool
