"""What an arm can reach, with proof: pure functions and kernels, no stage and no files."""
