"""MicroPython's `machine`, `time` and `os` as the firmware sees them on the simulated board: Board.install() puts them
in place. CPython and MicroPython both run them, except cpython.py, which adds what CPython lacks."""
