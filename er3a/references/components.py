"""How far many tables are off what references state, component by component: as each quantity says it
(:meth:`~er3a.references.quantities.Quantity.off`), those of one kind at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from er3a.kinematics.table_batch import Tables, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import TablesState
from er3a.references.quantities import (
    COORDINATES,
    FRAME_OF_POINT,
    FROM_UPRIGHT,
    MM,
    AxisAngle,
    AxisCoordinate,
    ModelState,
    PointCoordinate,
    Quantity,
    SectionCoordinate,
    SegmentAngle,
    TurnedApart,
    nearest_on_line,
)
from er3a.robots.robot import Robot

Reader = Callable[[ModelState], Reals]
"""Components (H, n, k) of n quantities of one kind."""


class Components:
    """Quantities, none of them an extreme over the limits, beside what is stated of them.

    Parameters
    ----------
    expected : (n,), in the quantities' units

    Attributes
    ----------
    sizes : (n,), how many components each has
    """

    def __init__(self, robot: Robot, quantities: Sequence[Quantity], expected: Sequence[float]):
        self._state = TablesState(robot, quantities)
        kinds: dict[str, list[int]] = {}
        for i, (quantity, value) in enumerate(zip(quantities, expected)):
            kinds.setdefault(_kind(quantity, value) or f"alone {i}", []).append(i)
        self._readers = [
            (own, _reader([quantities[i] for i in own], np.array([expected[i] for i in own]), self._state))
            for own in kinds.values()
        ]
        own_state = self._state.of(tables_of(robot))
        self.sizes = np.zeros(len(quantities), dtype=np.int64)
        for own, reader in self._readers:
            self.sizes[own] = reader(own_state).shape[-1]
        starts = (np.cumsum(self.sizes) - self.sizes)[:, None]
        self._columns = [(starts[own] + np.arange(self.sizes[own[0]])).ravel() for own, _ in self._readers]

    def off(self, tables: Tables) -> Reals:
        """Components (H, m), each quantity's side by side, whose length is how far tables are off, in its unit."""
        state = self._state.of(tables)
        off = np.empty((len(tables), int(self.sizes.sum())))
        for columns, (_, reader) in zip(self._columns, self._readers):
            off[:, columns] = reader(state).reshape(len(tables), -1)
        return off


def _kind(quantity: Quantity, expected: float) -> str:
    """What is read together; nothing for what is read alone."""
    if isinstance(quantity, AxisAngle):
        return "" if expected else "angle"
    if isinstance(quantity, SegmentAngle):
        return "" if expected else "segment"
    return {AxisCoordinate: "axis", PointCoordinate: "point", SectionCoordinate: "section"}.get(type(quantity), "")


def _reader(quantities: list[Quantity], expected: Reals, states: TablesState) -> Reader:
    first = quantities[0]
    if isinstance(first, AxisAngle) and not expected.any():
        return _angles([each for each in quantities if isinstance(each, AxisAngle)])
    if isinstance(first, SegmentAngle) and not expected.any():
        return _segments([each for each in quantities if isinstance(each, SegmentAngle)])
    if isinstance(first, AxisCoordinate):
        return _axis_points([each for each in quantities if isinstance(each, AxisCoordinate)], expected)
    if isinstance(first, PointCoordinate):
        return _points([each for each in quantities if isinstance(each, PointCoordinate)], expected, states)
    if isinstance(first, SectionCoordinate):
        return _sections([each for each in quantities if isinstance(each, SectionCoordinate)], expected, states)
    return lambda state: first.off(state, float(expected[0]))[:, None]


def _angles(quantities: list[AxisAngle]) -> Reader:
    joints = np.array([each.joint - 1 for each in quantities])
    toward = np.array([each.toward for each in quantities])
    signed = np.array([each.signed for each in quantities])
    turned = TurnedApart(toward)

    def read(state: ModelState) -> Reals:
        axis = state.frames[:, 0][:, joints][..., :3, 2] * state.direction[:, joints, None]
        backward = ~signed & (np.einsum("hni,ni->hn", axis, toward) < 0)
        return turned.from_these(np.where(backward[..., None], -axis, axis))

    return read


def _segments(quantities: list[SegmentAngle]) -> Reader:
    def read(state: ModelState) -> Reals:
        return FROM_UPRIGHT.from_these(np.stack([each.direction(state) for each in quantities], axis=1))

    return read


def _axis_points(quantities: list[AxisCoordinate], expected: Reals) -> Reader:
    joints = np.array([each.joint - 1 for each in quantities])
    near = np.array([each.point_mm for each in quantities])
    coordinates = np.array([COORDINATES.index(each.coordinate) for each in quantities])
    every = np.arange(len(quantities))

    def read(state: ModelState) -> Reals:
        T = state.frames[:, 0][:, joints]
        axis = T[..., :3, 2] * state.direction[:, joints, None]
        value = nearest_on_line(axis, T[..., :3, 3] * MM, near)[:, every, coordinates]
        off: Reals = (value - expected)[..., None]
        return off

    return read


def _points(quantities: list[PointCoordinate], expected: Reals, states: TablesState) -> Reader:
    places = np.array([states.index[each.pose] for each in quantities])
    frames = np.array([FRAME_OF_POINT[each.point] for each in quantities])
    coordinates = np.array([COORDINATES.index(each.coordinate) for each in quantities])

    def read(state: ModelState) -> Reals:
        off: Reals = (state.frames[:, places, frames, coordinates, 3] * MM - expected)[..., None]
        return off

    return read


def _sections(quantities: list[SectionCoordinate], expected: Reals, states: TablesState) -> Reader:
    places = np.array([states.index[each.pose] for each in quantities])
    along_x = np.array([each.coordinate == "x" for each in quantities])
    unsigned = np.array([each.unsigned for each in quantities])
    rows, origins = np.where(along_x, 0, 2), np.where(along_x, 0, 1)  # x is counted from axis 1, z from axis 2
    wrist = FRAME_OF_POINT["wrist_centre"]

    def read(state: ModelState) -> Reals:
        value = (state.frames[:, places, wrist, rows, 3] - state.frames[:, places, origins, rows, 3]) * MM
        off: Reals = (np.where(unsigned, np.abs(value), value) - expected)[..., None]
        return off

    return read
