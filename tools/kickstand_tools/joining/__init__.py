"""Joins a phone's or watch's track to a ride. The yaw of both shows the unknown offset between their clocks."""
