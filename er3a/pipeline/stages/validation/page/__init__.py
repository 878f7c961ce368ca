"""Page and recording of the stage validation: results in, views out."""
