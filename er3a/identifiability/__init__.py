"""Which numbers of a table its documents settle, and which nothing does."""
