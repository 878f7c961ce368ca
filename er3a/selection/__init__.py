"""Which of several joint solutions to take, for one pose or for a sequence of poses."""
