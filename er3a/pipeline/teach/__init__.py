"""The teach panel: one page to move the arm; its kinematics run in the browser."""
