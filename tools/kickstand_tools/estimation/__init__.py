"""Estimates a motorcycle's whole ride at once: Gauss-Newton over all of its readings, with the model of equations.py.

    windows.py        readings -> means over 0.2 s
    first_guess.py    where the bike stands, its lean and speed, roughly; for an alignment also the axes
    unknowns.py       the states, the parameters, and the prior of these
    equations.py      process model, measurement model and their Jacobian
    noise.py          process noise and measurement noise
    hypotheses.py     other changes possible in a ride, and the posterior weight of each such hypothesis
    solver.py         the linear least squares of one step: states by Schur complement, then the chain of blocks
    least_squares.py  the steps: states and parameters with their covariance

Two results: the alignment with its covariance (alignment.py, `kickstand calibrate ride`), and the smoothed lean with
its standard deviation (smooth.py, `kickstand smooth`).
"""
