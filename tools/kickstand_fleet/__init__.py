"""Alignment, moved mounts and brake tests of many vehicles.

manifest.py says which logs belong together, period.py works on the logs of one mount (a plain function on files;
evidence.py, forward.py and moved.py are its mathematics), cluster.py has Dask do so for all, journal.py keeps each
result as it comes, tables.py and the modules in show/ show them.
"""
