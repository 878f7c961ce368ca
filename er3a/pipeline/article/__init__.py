"""The page on the teaching article: its statements, er3a's results, and whether they agree."""
