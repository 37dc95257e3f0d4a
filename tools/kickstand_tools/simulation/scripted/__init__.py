"""Rides put together from a script, and the readings of a sensor with errors, in plain Python.

They run on CPython and on MicroPython. The demo, the emulated Pico, the bench and most tests use them: a reading
world(t_s) is computed when it is asked for.
"""
