"""The player: motions of an arm that a page plays, offline, with the teach panel's drawing code."""
