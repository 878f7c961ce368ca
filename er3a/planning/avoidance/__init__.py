"""Ways around the singular regions of a path of the tool: one module per way, each one function of a trouble."""
