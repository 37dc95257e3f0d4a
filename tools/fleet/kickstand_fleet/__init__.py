"""Alignment, moved mounts and brake tests of many vehicles.

manifest.py groups the logs by vehicle and mount. period.py processes the logs of one mount, with the mathematics in
evidence.py and moved.py. cluster.py runs period.py with Dask for all mounts. journal.py saves each result
at once. tables.py, page.py and plot.py write the results.
"""

KEPT = "finished work is kept: run the same command again to resume"
