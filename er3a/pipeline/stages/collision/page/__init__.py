"""Page and recording of the stage collision: results in, views out."""
