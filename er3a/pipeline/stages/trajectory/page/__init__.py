"""Page and recording of the stage trajectory: results in, views out."""
