"""Runs `kickstand bench`, which measures the costs of the firmware on an emulated board.

bench.py runs on the host. bench_guest.py and bluetooth_guest.py are copied to the board and run there.
"""
