"""Page and recording of the stage vision: results in, views out."""
