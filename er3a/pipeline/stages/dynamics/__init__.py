"""What the motors feel, and whether drives and wrist bear it."""
