"""Compares the lean that the firmware shows, and the lean of other estimators, with the true lean.

The true lean of simulated rides is known. For a recorded ride the true lean is only estimated. `kickstand evaluate`
prints the results.
For example:

    from kickstand_workshop.evaluation.runs import Job, run
    print(run(Job("street", seed=1)).scores["kickstand"].rms_deg)
"""
