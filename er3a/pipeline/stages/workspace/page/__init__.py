"""Page and recording of the stage workspace: results in, views out."""
