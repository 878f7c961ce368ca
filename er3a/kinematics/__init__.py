"""Kinematics: pure functions over arrays, without files or stages. Joint values are the manufacturer's, lengths in
metres.

- From joints to poses: ``chain`` (the table as kernels take it), ``forward`` (and the Jacobian), ``table_batch`` (many
  tables at once).
- From poses to joints: ``inverse`` for one pose, ``batch`` for many. Arms with a spherical wrist are solved in closed
  form (``wrist_partitioned`` recognises them; ``closed_form``, over blocks of poses ``block_inverse``), others by the
  solver of their class (``by_class``, ``classes``). ``numerical`` iterates, ``neighbours`` finds poses near one without
  a solution, ``round_trips`` tests whether the inverse finds the joint values that made a pose.
- Self-motions (the joints move, the tool does not): ``families`` (spherical wrists), ``self_motions`` (others).
- ``singularity`` defines near-singular and finds it along motions; ``solutions`` holds the result types.
"""
