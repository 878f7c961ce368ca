"""What references and checks are about, as findings: codes with parameters, of which ``messages/references.py`` has the
texts.

``axis_direction`` (``joint``, ``signed``: of positive rotation), ``axis_position`` (``joint``, ``coordinate``),
``point_at_pose`` (``pose``, ``point``, ``coordinate``), ``orientation_at_pose`` (``pose``, ``coordinate``),
``pose_excess`` (``pose``: by how much it lies outside the limits), ``segment_inclination`` (``segment``),
``drawing_corner`` (``q2_deg``, ``q3_deg``, ``coordinate``), ``drawing_extent`` (``extreme``, ``axis``), ``reach``
(``extreme``, ``point``, ``axis``), ``joint_limit`` (``joint``, ``side``), ``joint_speed`` (``joint``),
``motion_of_joint`` (``joint``, ``point``, ``seen``), ``entry_of_table`` (``column``, ``joint``). A coordinate of None
means the whole vector.
"""

from __future__ import annotations

from er3a.finding import Finding

Subject = Finding


def key_of(subject: Subject) -> str:
    """A subject as one word for tables.

    Parameters
    ----------
    subject : of a reference or a check

    Returns
    -------
    key : such as ``axis_position(3, x)``
    """
    return f"{subject.code}({', '.join(str(value) for value in subject.params.values() if value is not None)})"
