"""Where an arm is free of collisions."""
