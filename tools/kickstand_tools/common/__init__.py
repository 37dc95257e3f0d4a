"""Helpers for all parts of the tools.

They cover errors and messages, entry points, files written whole or not at all, progress, times, templates, SVG,
MicroPython's unix port, and the locations of files.
"""
