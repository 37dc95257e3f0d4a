"""`kickstand demo`: device.py runs the firmware on the simulated board in a process of its own; the other modules draw
or print what its display shows, and score it. `kickstand emulate` uses screen, keyboard and hand_bike too.
"""
