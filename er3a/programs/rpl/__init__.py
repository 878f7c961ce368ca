"""EFORT RPL, as text and as XML: its record, reader, dialect and writer."""
