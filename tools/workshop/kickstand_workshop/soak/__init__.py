"""A long time on the simulated board: random rides, faults and presses, and checks that must hold all the while.

    python -m kickstand_workshop.soak --hours 24 --seed 1

trip.py makes a trip up, watch.py watches the display during it, soak.py runs trips and counts.
"""
