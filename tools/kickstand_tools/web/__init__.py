"""`kickstand web`: pages that run the firmware on the simulated board, install it on a real board, watch a board and
fetch its recordings, show a ride, and show the project's documents.

page/ contains our files for the browser. There, device.py runs on MicroPython, and the modules browser_*.py run on
CPython. npm/ lists the packages to download, including these two interpreters. The other modules build and serve the
site.
"""
