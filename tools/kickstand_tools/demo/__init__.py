"""`kickstand demo`: device.py runs the firmware on the simulated board in a separate process. The other modules draw or
print its display, and score it. `kickstand emulate` uses screen, keyboard and hand_bike too.
"""
