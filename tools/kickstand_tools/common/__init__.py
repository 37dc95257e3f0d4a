"""Helpers for all parts of the tools: errors, complete writing of files, progress, templates, SVG, locations of
files."""
