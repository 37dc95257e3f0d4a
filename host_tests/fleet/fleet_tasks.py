"""Tasks for the workers of a fleet, good and bad ones. They are in a module because workers import them."""

import os
import time
from pathlib import Path


def task(number, behaviour="", note=""):
    """Returns its number. behaviour: "die" ends the worker, "hang" never returns, "raise" raises, "slow" takes a while.
    note: a file that gets a line with the worker's process id at each start of the task."""
    if note:
        with Path(note).open("a") as file:
            file.write(f"{number} {os.getpid()}\n")
    if behaviour == "die":
        os._exit(3)
    if behaviour == "hang":
        time.sleep(600.0)
    if behaviour == "raise":
        raise ValueError("on purpose")
    if behaviour == "slow":
        time.sleep(0.6)
    return number
