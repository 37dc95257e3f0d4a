"""A long test on the simulated board: random rides, faults and presses, with checks that must always hold.

    python -m kickstand_workshop.soak --hours 24 --seed 1

trip.py makes a random trip, watch.py checks display and bus during it, soak.py runs trips and keeps tallies.
"""
