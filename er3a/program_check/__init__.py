"""Checks what a robot program makes an arm do, before it is loaded."""
