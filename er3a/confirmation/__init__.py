"""Whether a model agrees with its controller: joint values and the poses that a pendant shows for them."""
