"""Draws a ride's lean, forces and speed over a video of it, or as a transparent clip."""
