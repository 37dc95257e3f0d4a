"""Estimates a motorcycle's ride from all of its readings at once, by Gauss-Newton steps.

    windows.py        readings -> means over 0.2 s, with standstills, rough lean and speed
    model.py          unknowns with their priors, hypotheses about mount and wind, equations and their Jacobian
    noise.py          process noise and measurement noise
    solver.py         linear least squares of one step: Schur complement over states, then the chain of blocks
    least_squares.py  all steps; estimates states and parameters with their covariance

There are two results: the alignment with its covariance (alignment.py, `kickstand calibrate ride`), and the smoothed
lean with its standard deviation (smooth.py, `kickstand smooth`).
"""
