"""Pure functions over arrays: no files, no stages. Angles are the manufacturer's, lengths metres."""
