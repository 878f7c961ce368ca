"""ABB RAPID: its record, reader, dialect and writer."""
