"""A study to start from, written for an arm that a person brings."""
