"""Robots in other people's formats: ``urdf`` in and out and tables from joint axes; ``urdf_tree`` reads what a URDF
holds (chain, masses, shapes), ``mesh_file`` its meshes.
"""
