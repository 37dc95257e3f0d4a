"""Recorded logs: the values that a CSV may have, reading, writing and cutting, uneven times and frozen readings."""
