"""Helpers for the tests of the simulated board. Runs on MicroPython too."""

from kickstand_sim.simulated_board.simulator import Board

LEVEL = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def level(t_s):
    """Return the readings of a chip that lies flat and still: a world() for a board."""
    return LEVEL


def rough(t_s):
    """Return readings of a sensor at rest, with the means 0.5 g, 0.25 g and 0.75 g. No axis is constant."""
    a, b, c = (t_s * k % 1 - 0.5 for k in (977, 577, 433))
    return (0.5 + 0.004 * a, 0.25 + 0.004 * b, 0.75 + 0.004 * c, 0.4 * b, 0.4 * c, 0.4 * a, 31.0)


def raised(function, *args):
    """Return the exception that function(*args) raises, or None."""
    try:
        function(*args)
    except BaseException as error:
        return error
    return None


def read(chip, register, count=1):
    """Read `count` bytes from a device model in one burst, as a list."""
    chip.start(chip.address, False)
    chip.write_byte(register)
    chip.start(chip.address, True)
    return [chip.read_byte() for _ in range(count)]


def write(chip, register, *values):
    """Write bytes to a device model in one transfer."""
    chip.start(chip.address, False)
    chip.write_byte(register)
    for value in values:
        chip.write_byte(value)


def counts(chip):
    """Read one burst. Return the seven signed numbers in it: three forces, the temperature, three rates."""
    data = read(chip, 0x3B, 14)
    values = [data[2 * i] << 8 | data[2 * i + 1] for i in range(7)]
    return [value - 65536 if value > 32767 else value for value in values]


def on_board(program, until_s=1.0, **fitted):
    """Run program(board) on a new Board(**fitted). Return (outcome, board). Without `world` the board is at rest."""
    world = fitted.pop("world", level)
    board = Board(world, **fitted)
    board.install()
    try:
        outcome = board.run(lambda: program(board), until_s)
    finally:
        board.uninstall()
    return outcome, board


def firmware(until_s=30.0, **fitted):
    """Decorate test(board), so that it runs as the firmware of a new Board(**fitted). The test must run to its end."""

    def decorated(function):
        def test():
            outcome, _ = on_board(function, until_s, **fitted)
            assert outcome == "returned"

        return test

    return decorated
