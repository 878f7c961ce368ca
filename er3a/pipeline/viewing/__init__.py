"""What recordings and reports share. Nothing here computes a result."""
