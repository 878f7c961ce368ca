"""What an arm can reach, with proof: pure functions and kernels, no stage and no files.

- The volume: begin with ``proven``; ``section_proof`` decides cells of arms with a spherical wrist, in the form of
  ``section_arm``, and ``general_proof`` those of any arm (``general_arm``). ``voids`` and their ``causes``;
  ``side_view`` as manufacturers draw it.
- What the tool can do there: ``capability`` by samples, in the cells of ``cell_frame`` and along ``directions`` or
  other ``orientations``; ``dexterous`` (every direction) and ``placement`` (where a box can stand) with proofs, which
  rest on ``interval_inverse``; ``tool_inverse`` for all of them.
"""
