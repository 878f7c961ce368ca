"""Rigid transforms, vectors and directions."""
