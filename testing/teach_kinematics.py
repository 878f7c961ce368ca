"""The teach panel's kinematics, called in a page that is open in a browser."""

from __future__ import annotations

from er3a.kinematics.singularity import NearSingular

NEAR = NearSingular(0.1, 0.1, 0.03)

SOLVE = """
const [panel, joints, done] = arguments;
Promise.all([import("er3a/kinematics"), import("er3a/inverse")]).then(([kinematics, inverse]) => {
  const { table, characteristic_length: length } = panel;
  const links = kinematics.constantLinks(table);
  const arm = panel.no_closed_form ? null : inverse.closedForm(table, links);
  done(joints.map((q) => {
    const T = kinematics.frames(table, links, q);
    return {
      T: T[6],
      measures: kinematics.conditioning(table, T, length),
      factors: panel.singular_sets && kinematics.determinantFactors(T, panel.singular_sets),
      solved: arm && inverse.inverse(table, arm, T[6], q),
    };
  }));
}).catch((error) => done(String(error.stack)));
"""
