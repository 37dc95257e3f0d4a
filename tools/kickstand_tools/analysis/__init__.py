"""Analyses a recorded ride: the vehicle's channels, statistics, brake tests, pictures, files for other programs."""
