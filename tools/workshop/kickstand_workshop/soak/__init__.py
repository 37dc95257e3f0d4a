"""Tests the firmware on the simulated board for hours, with random rides, faults and presses.

    python -m kickstand_workshop.soak --hours 24 --seed 1

trip.py makes a random trip. soak.py runs trips, checks display and bus, and keeps tallies.
"""
