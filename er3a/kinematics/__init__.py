"""Pure functions over arrays: no files, no stages. Angles are the manufacturer's, lengths metres.

- From joints to poses: ``chain`` (the table as kernels take it), ``forward`` (and the Jacobian), ``table_batch`` (many
  tables at once), ``symbolic`` (as formulas).
- From poses to joints: ``inverse`` for one pose, ``batch`` for many. Arms with a spherical wrist are solved in closed
  form (``wrist_partitioned`` recognises them; ``closed_form``, over blocks of poses ``block_inverse``), others through
  ``by_class`` by the solver of their class (``classes``). ``numerical`` iterates, ``neighbours`` finds poses near one
  that has no solution, ``cuspidal`` says whether branches are joined without a singularity, ``round_trips`` whether the
  inverse finds what made a pose.
- What joints can do with the tool at rest: ``families`` (spherical wrists), ``self_motions`` (others).
- ``singularity`` says what near-singular means and where a motion is so; ``solutions`` is what all of it gives.
"""
