"""The page on the article that the project began with: what it says, what er3a computes, and whether they agree."""
