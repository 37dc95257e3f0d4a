"""Writes what a simulated sensor reads as a log file."""

import gzip

HEADER = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n"


def capture(world, seconds, rate_hz, path, start_s=0.0):
    """Write `seconds` of world (see sensor_errors.py), from start_s on, to path; gzipped if that ends in .gz.

    Times in the log start at 0.
    """
    path = str(path)
    opened = gzip.open(path, "wt") if path.endswith(".gz") else open(path, "w")
    with opened as log:
        log.write(HEADER)
        for n in range(round(seconds * rate_hz)):
            t_s = n / rate_hz
            log.write("%.6f," % t_s)
            log.write(",".join(["%.6f" % value for value in world(start_s + t_s)[:6]]) + "\n")
