"""Robot programs: one model, readers and writers for the languages of controllers, and what a program does when run."""
