"""What tests and campaigns share, and neither owns: cases to try, and judges that don't ask er3a.

``arms``, ``singular_poses``, ``random_paths``, ``input_files``, ``made_stage`` and ``mutants`` make cases; ``arms``,
``exact_paths`` and ``file_judge`` work out by other means what should come out; ``chromium``, ``teach_kinematics`` and
``small_study`` run what is tried. It is not part of the package and imports neither ``tests`` nor ``benchmarks``.
"""
