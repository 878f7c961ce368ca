"""One folder per stage: compute (numbers), record (Rerun), report (HTML). A stage never imports another."""
