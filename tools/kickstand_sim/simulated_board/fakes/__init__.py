"""MicroPython's `machine`, `time` and `os` for the firmware on the simulated board. Board.install() installs them.
CPython and MicroPython both run them, except cpython.py, which adds what CPython lacks."""
