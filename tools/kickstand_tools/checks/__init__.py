"""Checks a log and returns remarks as data. Each remark is a class with its fields, its text and a remedy. The checks
need no data about the vehicle.

    cells.py                     averages the log over cells of time, for the other modules
    units.py                     checks units
    handedness.py, turning.py,
    bends.py, course.py          check axes and signs
    mount.py                     compares a calibration with a log
    log.py                       runs all checks above
    sensor.py                    finds dead axes, and a gyro at the end of its range; their readings are left out
"""
