"""Recorded rides: fetched from a board or streamed over USB, and their blocks turned into logs."""
