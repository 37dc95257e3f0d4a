"""`kickstand web`: a page in which the firmware runs on the simulated board, and from which it is put onto a real one.

page/ is what the browser gets of ours. device.py runs in it on MicroPython, install_guest.py on CPython; npm/ names
both packages. The other modules put the site together and serve it.
"""
