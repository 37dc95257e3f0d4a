"""What can be said about a log without knowing the vehicle, as data: notices, a code and numbers each.

cells.py: the log as a table of cells, which all others judge. units.py: the units. handedness.py (with
turning.py), bends.py, course.py: axes and signs. mount.py: a calibration. log.py: all of them, for whoever reads a log.
The words are in refusals.py.
"""
