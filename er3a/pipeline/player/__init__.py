"""The player: plays motions of an arm on a page, offline, with the teach panel's drawing code."""
