"""The reach of the tool point: a Monte Carlo cloud, touched cells and voids."""
