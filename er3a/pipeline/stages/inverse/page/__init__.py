"""Page and recording of the stage inverse: results in, views out."""
