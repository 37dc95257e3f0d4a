"""Converts recordings of other apps and loggers to logs: recognises the format, units and signs, joins the clocks."""
