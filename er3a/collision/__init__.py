"""Shapes of arms and scenes, distances, and collision checks along motions."""
