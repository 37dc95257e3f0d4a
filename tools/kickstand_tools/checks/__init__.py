"""Checks a log and returns remarks as data. Each remark is a class with its fields, its text and a remedy. The checks
need no data about the vehicle.

cells.py reduces the log to a table of cells, which the other modules judge. units.py checks units. handedness.py (with
turning.py), bends.py and course.py check axes and signs. mount.py compares a calibration with a log. log.py runs all of
these checks. sensor.py finds dead axes and a gyro at the end of its range, whose readings are left out.
"""
