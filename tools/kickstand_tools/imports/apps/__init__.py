"""One module for each known log format. find_recordings() selects the files; read() converts them to an AppRecording.

For a new log format, add a module here and an entry in _APPS in ../importing.py.
"""
