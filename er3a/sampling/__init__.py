"""Millions of random joint vectors: drawn, taken to their tool points and counted, block by block."""
