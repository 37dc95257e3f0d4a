"""Helpers for all parts of the tools: errors and messages, entry points, complete writing of files, progress, times,
templates, SVG, the unix port, locations of files."""
