"""Compares the lean that the firmware shows, and the lean of other estimators, with the true lean.

The true lean of simulated rides is known. For a recorded ride the true lean is only estimated. `kickstand evaluate`
prints the results.
"""
