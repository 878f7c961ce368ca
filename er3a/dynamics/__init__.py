"""What the motors feel: torques, powers and holding loads of an arm whose masses are known."""
