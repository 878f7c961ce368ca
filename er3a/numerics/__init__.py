"""What kernels are made of: compiling, threads, vectorised functions, small linear systems, even points."""
