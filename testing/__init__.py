"""What tests and campaigns share: test cases, and judges that are independent of er3a.

``arms``, ``singular_poses``, ``random_paths``, ``input_files``, ``made_stage`` and ``mutants`` make cases; ``arms``,
``exact_paths`` and ``file_judge`` compute the expected results by other means; ``chromium``, ``teach_kinematics`` and
``small_study`` run pages and studies. It is not part of the package and imports neither ``tests`` nor ``benchmarks``.
"""
