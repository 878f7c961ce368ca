"""What stands around an arm."""
