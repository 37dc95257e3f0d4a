"""Tasks for the workers of a fleet. Some of the tasks fail. The tasks are in a module of their own, because workers
must import them."""

import os
import time
from pathlib import Path


def task(number, behaviour="", note=""):
    """Return the task's number.

    behaviour: "die" ends the worker, "hang" never returns, "raise" raises an error.
    note: path of a file. Each start of the task adds a line with its number and the worker's process id.
    """
    if note:
        with Path(note).open("a") as file:
            file.write(f"{number} {os.getpid()}\n")
    if behaviour == "die":
        os._exit(3)
    if behaviour == "hang":
        time.sleep(600.0)
    if behaviour == "raise":
        raise ValueError("on purpose")
    return number
