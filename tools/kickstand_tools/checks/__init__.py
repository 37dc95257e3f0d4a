"""Checks a log and returns remarks as data. Each remark is a Message with its fields, its text and a remedy.

bins.py              averages the log over bins of time, for the other modules
axes.py, turning.py  check axes, their signs and the unit of the rates
sensor.py            finds readings that were not measured
log.py               runs all checks, and checks units
"""
