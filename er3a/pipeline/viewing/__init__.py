"""Shared by recordings and reports. Nothing here computes a result."""
