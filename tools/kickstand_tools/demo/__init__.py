"""`kickstand demo`: device.py runs the firmware on the simulated board in a separate process. The other modules draw or
print its display, and compare the shown lean with the true lean. `kickstand emulate` also uses screen, keyboard and
hand_bike.
"""
