"""Millions of random joint vectors: drawn (``random_joints``), mapped to tool points (``point_chain``) and counted
(``tally``) in cells (``grid``), block by block.
"""
