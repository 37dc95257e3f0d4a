"""`kickstand bench`: measures the costs of the firmware on an emulated board. bench.py runs on the host; bench_guest.py
and stages_guest.py are copied to the board and run there.
"""
