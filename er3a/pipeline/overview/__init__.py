"""Pages over all robots of a study: the index, the comparison, what may stand on the tray."""
