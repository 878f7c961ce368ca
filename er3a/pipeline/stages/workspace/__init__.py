"""The reach of the tool point: a Monte Carlo cloud, its hull, touched cells and voids."""
