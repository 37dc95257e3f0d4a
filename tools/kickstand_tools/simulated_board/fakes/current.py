"""The simulated board that the fakes of `machine` act on: the one that was installed last."""

CALL_US = 2  # what a call into `machine` takes, so that a loop that waits for a pin comes to an end


def use(installed):
    """From now on `machine` acts on this simulator.Board."""
    global board
    board = installed
