"""`kickstand web`: pages that run the firmware on the simulated board, install it on a real one, watch a board and
fetch its recordings, show a ride, and show the project's documents.

page/ contains our files for the browser; documents/ makes pages from the documents. In the browser, device.py runs on
MicroPython, the modules *_guest.py on CPython. npm/ names both packages and the others to download. The other modules
build the site and serve it.
"""
