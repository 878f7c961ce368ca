"""Which joint solutions reach a pose, and which to take?"""
