"""A phone's or watch's track put to a ride: matched by how both turn, at an unknown offset of their clocks."""
