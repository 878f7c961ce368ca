"""A tool's or a payload's mass in a study: stated, or from a closed mesh and a density."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from er3a.errors import InputError
from er3a.files.mass_fields import HEAVIEST_PAYLOAD_KG, IMPOSSIBLE, BodyFields
from er3a.files.units import Triple
from er3a.files.yaml_file import StrictModel
from er3a.geometry.transforms import transform
from er3a.robots.masses import Load, MassBody, moved, no_body, six_moments, together
from er3a.robots.robot import Grade

THREE_ZEROS = [0.0, 0.0, 0.0]
Newton = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=3, max_length=3)]


class MeshMass(StrictModel):
    """A body from a closed mesh: ``unit_mm`` is what a unit of the file is in mm; placed in the flange's frame."""

    file: Annotated[str, Field(min_length=1, max_length=1000)]
    density_kg_m3: Annotated[float, Field(ge=1, le=25_000)]
    unit_mm: Annotated[float, Field(ge=1e-3, le=1e4)] = 1.0
    xyz_mm: Triple = THREE_ZEROS
    rpy_deg: Triple = THREE_ZEROS


class LoadFields(StrictModel):
    """What hangs on the flange, in its frame, with source and grade: ``body`` or ``mesh``.

    ``force_n`` and ``moment_n_m``: what the surroundings do to the tool at the tool point, in the tool's axes.
    """

    source: Annotated[str, Field(min_length=1, max_length=2000)]
    grade: Grade
    body: BodyFields | None = None
    mesh: MeshMass | None = None
    force_n: Newton = THREE_ZEROS
    moment_n_m: Newton = THREE_ZEROS

    @model_validator(mode="after")
    def _one_of_both(self):
        if (self.body is None) == (self.mesh is None):
            raise ValueError("body: a load needs a body or a mesh, and not both | Give one of the two")
        if self.body and self.body.mass_kg > HEAVIEST_PAYLOAD_KG:
            kg = self.body.mass_kg
            raise ValueError(f"body.mass_kg: {kg:g} kg is more than any robot carries | Write {kg / 1000:g} if it is g")
        return self

    @property
    def files(self) -> list[Path]:
        """The mesh, if there is one."""
        return [Path(self.mesh.file)] if self.mesh else []


def load_of(loads: list[LoadFields]) -> Load | None:
    """Tool and payload as one load; None without any.

    Raises
    ------
    InputError
        for a mesh that can't be read, or that is not closed
    """
    if not loads:
        return None
    body = together([_body(each) for each in loads])
    force, moment = (np.sum([getattr(each, key) for each in loads], axis=0) for key in ("force_n", "moment_n_m"))
    (fx, fy, fz), (mx, my, mz) = force.tolist(), moment.tolist()
    return Load(
        body.mass,
        body.centre,
        body.inertia,
        body.mass_tolerance,
        body.centre_tolerance,
        force=(fx, fy, fz),
        moment=(mx, my, mz),
    )


def _body(load: LoadFields) -> MassBody:
    return load.body.body if load.body else mesh_body(load.mesh)  # type: ignore[arg-type]  # one of both is there


def mesh_body(given: MeshMass) -> MassBody:
    """Mass, centre and inertia of a closed mesh filled evenly; :class:`InputError` if it is none."""
    import trimesh  # slow to import, and few studies need it

    try:
        mesh = trimesh.load_mesh(given.file)
    except Exception as error:  # whatever a reader of a format raises
        raise InputError(
            given.file, None, f"can't be read as a mesh ({error})", "Give an STL, OBJ or PLY file"
        ) from None
    if not (mesh.is_watertight and mesh.is_winding_consistent and abs(mesh.volume) > 0):
        raise InputError(given.file, None, "is no closed mesh, so it has no volume", "Close its holes, or state a body")
    if mesh.volume < 0:
        mesh.invert()
    mesh.apply_scale(given.unit_mm / 1000)
    mesh.density = given.density_kg_m3
    x, y, z = mesh.center_mass.tolist()
    body = MassBody(float(mesh.mass), (x, y, z), six_moments(mesh.moment_inertia))
    if problem := no_body(body):
        raise InputError(given.file, None, IMPOSSIBLE[problem], "Check the mesh")
    if body.mass > HEAVIEST_PAYLOAD_KG:
        raise InputError(given.file, None, f"makes {body.mass:g} kg", "Check unit_mm: 1 for mm, 1000 for m")
    return moved(body, transform(np.array(given.xyz_mm) / 1000, np.radians(given.rpy_deg)))
