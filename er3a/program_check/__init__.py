"""Checks of robot programs, motion by motion."""
