"""Every sentence that er3a says, in the reader's language."""
