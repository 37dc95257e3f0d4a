"""Joins a phone's or watch's track to a ride, and compares two devices on one ride, whose clocks differ by any time."""
