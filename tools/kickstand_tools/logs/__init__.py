"""Recorded logs: what may stand in a CSV, how it is read, and whether its units are the right ones."""
