"""Where the tool point can be: a Monte Carlo cloud, its hull, the cells it touches and the voids it leaves."""
