"""What a study costs before it is run: its jobs, what each takes on this machine, and how they fill some cores."""
