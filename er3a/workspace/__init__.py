"""What an arm can reach, with proof: pure functions and kernels, without stages or files.

- The volume: start with ``proven``. ``section_proof`` decides cells of arms with a spherical wrist (``section_arm``),
  ``general_proof`` those of any arm (``general_arm``). ``voids`` and their ``causes``; the ``side_view`` of data
  sheets.
- What the tool can do there: ``capability`` from samples, in the cells of ``cell_frame`` and along ``directions`` or
  other ``orientations``; ``dexterous`` (every direction) and ``placement`` (where a box can be placed) with proofs by
  ``interval_inverse``. All use ``tool_inverse``.
"""
