"""Remarks about a log, as data: a class for each, with its fields, its words and what to do. Nothing about the vehicle
must be known.

cells.py: the log as a table of cells, which the other modules judge. units.py: units. handedness.py (with
turning.py), bends.py, course.py: axes and signs. mount.py: a calibration against a log. log.py: all of these together,
for whoever reads a log. sensor.py: dead axes and a gyro at the end of its range, whose readings are left out.
"""
