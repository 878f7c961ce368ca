"""Reference data: what documents and CAD models say about an arm, as scalars that a model can be held against."""
