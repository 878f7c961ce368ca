"""Page of the stage vision: results in, view out."""
