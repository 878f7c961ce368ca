"""Reference data: values from documents and CAD models about an arm, as scalars to compare a model with.

``rows`` is the registry of kinds. A row states ``quantities`` about ``subjects``; each is a ``reference``, whose value
for a model ``predict`` computes. ``seen``: observations by eye.
"""
