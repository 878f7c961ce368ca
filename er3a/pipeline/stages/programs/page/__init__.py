"""Page and recording of the stage programs: results in, views out."""
