"""Robot programs: one model, readers and writers for controller languages, and their execution."""
