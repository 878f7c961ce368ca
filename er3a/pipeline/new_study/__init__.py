"""``er3a new``: a study for a user's arm."""
