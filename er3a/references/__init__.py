"""Reference data: what documents and CAD models say about an arm, as scalars that a model can be held against.

``rows`` is the registry of kinds; a row states ``quantities`` about ``subjects``, each a ``reference``, which
``predict`` holds models against. ``seen``: what needs no instrument; ``circle_points``: what a tracker measures.
"""
