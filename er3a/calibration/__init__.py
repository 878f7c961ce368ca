"""Corrections to a table's entries from measured positions, with their uncertainty."""
