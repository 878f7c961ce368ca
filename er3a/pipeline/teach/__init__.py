"""The teach panel: one page in which a person moves the arm; its kinematics run in the browser."""
