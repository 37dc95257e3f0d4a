"""Recordings of other apps and loggers as logs: what a file is, its units and signs, its sensors on one clock."""
