"""Rigid transforms, vectors and directions. The lowest room that knows space."""
