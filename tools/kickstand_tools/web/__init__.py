"""`kickstand web`: pages in which the firmware runs on the simulated board, from which it is put onto a real one, which
watch and fetch what a board records, which look at a ride, and which show the project's documents.

page/ is what the browser gets of ours; documents/ makes pages of the documents. device.py runs in the browser on
MicroPython, the modules *_guest.py on CPython; npm/ names both packages and what else is fetched. The other modules put
the site together and serve it.
"""
