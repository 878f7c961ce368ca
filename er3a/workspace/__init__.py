"""What an arm can reach, with proof: pure functions and kernels, without stages or files.

- The volume: start with ``proven``. ``general_proof`` decides ``cells`` of any arm (``general_arm``): it fills them,
  and ``outer_sets`` leave them empty. ``voids`` and their ``causes``.
- What the tool can do there, from samples: ``capability`` in the cells of ``cell_frame`` and along ``directions`` or
  other ``orientations``, and ``placement`` (where a box can be placed). All use ``tool_inverse``.
"""
