"""Torques of the motors, and whether drives and wrist can supply and bear them."""
