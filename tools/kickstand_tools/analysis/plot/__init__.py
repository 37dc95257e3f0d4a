"""Draws a ride: a picture with matplotlib, and a page to zoom into with plotly."""
