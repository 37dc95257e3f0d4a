"""The firmware's lean meter run over a recorded log, on this Python, on MicroPython, or on an emulated Pico."""
