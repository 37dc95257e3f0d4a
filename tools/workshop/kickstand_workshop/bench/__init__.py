"""`kickstand bench`: what the firmware costs on an emulated board. bench.py is the host's part; bench_guest.py and
stages_guest.py are put on the board and run there.
"""
