"""Numerical basics: compiled kernels, threads, vectorised functions, small linear systems, quasi-random points."""
