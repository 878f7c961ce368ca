"""KUKA KRL: its record, reader, dialect and writer."""
