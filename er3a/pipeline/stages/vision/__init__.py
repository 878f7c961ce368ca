"""The stage `vision`: is the camera calibrated well enough, and which detected objects can be grasped?"""
