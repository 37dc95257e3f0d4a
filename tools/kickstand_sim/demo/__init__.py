"""Runs `kickstand demo`.

device.py runs the firmware on the simulated board in a separate process. The other modules draw or print the display,
and compare the shown lean with the true lean. `kickstand emulate` uses screen.py, keyboard.py and hand_bike.py too.
"""
