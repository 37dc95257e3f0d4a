"""Draws the lean, forces and speed of a ride over a video, or as a transparent clip."""
