"""Joins a phone's or watch's track to a ride. The yaw of ride and track shows the unknown offset between their
clocks."""
