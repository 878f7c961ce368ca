"""Reading files that people write: YAML and CSV, with one clear error naming file, field and remedy."""
