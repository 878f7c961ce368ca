"""Paths in joint and Cartesian space, their time law, and how an arm follows them. Knows no stage."""
