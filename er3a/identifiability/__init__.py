"""Which numbers of a table its documents settle, and which nothing does.

Begin with ``evidence``, which judges entry by entry (``entries``; what it finds: ``entry_evidence``). It asks
``reactions`` which references speak of an entry, makes ``requirements`` of them, and lets ``continuous`` (over the
``feasible`` tables) and ``alternatives`` (discrete changes) say what they leave open. ``statements`` says whether it
is another robot, ``proposals`` what to measure next.
"""
