"""The shown lean and other estimators against the truth of simulated rides, and over a recorded one.

from kickstand_tools.evaluation.runs import Job, run
print(run(Job("street", seed=1)).scores["kickstand"])
"""
