"""Simulates scripted rides, and the readings of a sensor with errors, in plain Python.

The modules run on CPython and on MicroPython. The demo, the emulated Pico, the bench and most tests use them. The
modules create a function world(t_s), which returns the reading at the time t_s.
"""
