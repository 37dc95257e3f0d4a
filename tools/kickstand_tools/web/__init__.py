"""`kickstand web`: a page in which the firmware runs on the simulated board. page/ is what the browser gets of ours;
device.py runs in it, on MicroPython; npm/ names the MicroPython to fetch; the other modules put the site together.
"""
