"""Whether two tables describe the same arm."""
