"""Does a path run into a singularity, a limit, or out of reach?"""
