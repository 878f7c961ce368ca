"""Diagnosis: which fault of a table explains its disagreement with the references."""
