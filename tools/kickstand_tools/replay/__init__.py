"""Runs the firmware's lean meter over a recorded log on this Python, on MicroPython or on an emulated Pico."""
