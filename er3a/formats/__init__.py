"""Robots in other people's formats: URDF, and tables from joint axes."""
