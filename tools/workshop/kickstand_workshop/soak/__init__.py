"""A long time on the simulated board: random rides, faults and presses, and checks that must hold all the while.

    python -m kickstand_workshop.soak --hours 24 --seed 1

trip.py makes a random trip, watch.py checks display and bus during it, soak.py runs trips and keeps tallies.
"""
