"""Foreign robot formats: ``urdf`` (import, export, and tables from joint axes), ``urdf_tree`` (chain, masses and shapes
of a URDF) and ``mesh_file`` (its meshes).
"""
