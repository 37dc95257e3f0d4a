"""`kickstand bench`: what the firmware costs on the emulated Pico. bench.py is the host's part; bench_guest.py and
stages_guest.py are put on the emulated Pico and run there.
"""
