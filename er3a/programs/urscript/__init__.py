"""URScript: its record, reader, dialect and writer."""
