"""Compares the firmware's shown lean, and other estimators, with the true lean: on simulated rides, whose lean is
known, and on a recorded one. `kickstand evaluate` prints the results.

from kickstand_workshop.evaluation.runs import Job, run
print(run(Job("street", seed=1)).scores["kickstand"].rms_deg)
"""
