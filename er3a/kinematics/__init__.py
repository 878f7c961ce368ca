"""Pure functions over arrays: no files, no stages. Angles are the maker's, lengths metres."""
