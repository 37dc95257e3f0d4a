"""Scripted rides, and the readings of a sensor with errors, in plain Python.

They run on CPython and on MicroPython. The demo, the emulated Pico, the bench and most tests use them. The function
world(t_s) computes the reading at the time t_s.
"""
