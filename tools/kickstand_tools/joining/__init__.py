"""Joins a phone's or watch's track to a ride: matched by the yaw of both, at an unknown offset of their clocks."""
