"""The stage that checks robot programs."""
