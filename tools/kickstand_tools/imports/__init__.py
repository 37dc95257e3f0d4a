"""Converts recordings of other apps and loggers to logs: recognises format, units and signs, and joins the clocks."""
