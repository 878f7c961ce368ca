"""The robot model: D-H rows, joint direction and offset, limits, speeds, base and tool, read from YAML."""
