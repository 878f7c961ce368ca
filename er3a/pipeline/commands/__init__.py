"""The commands, one module for each group of ``er3a --help``."""
