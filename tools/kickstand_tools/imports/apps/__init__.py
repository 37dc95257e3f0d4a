"""The known log formats, one module each: finds() selects its files, read() converts them to an AppRecording.

A new log format is a new module here, and an entry in _APPS in ../importing.py.
"""
