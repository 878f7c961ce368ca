"""Identifiability: which entries of a table its documents settle, and which remain open.

Begin with ``evidence``, which judges entry by entry (``entries``; what it finds: ``entry_evidence``). ``reactions``
finds the references that depend on an entry, ``requirements`` turns them into constraints, and ``continuous`` (over the
``feasible`` tables) and ``alternatives`` (discrete changes) find the values that these allow. ``statements`` says
whether the table describes another robot, ``proposals`` what to measure next.
"""
