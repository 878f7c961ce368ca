"""Page and recording of the stage dynamics: results in, views out."""
