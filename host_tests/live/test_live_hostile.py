"""A phone connects, writes and disconnects at random, hundreds of times. Most writes are invalid. The device continues.

test_live_micropython.py runs this test on MicroPython, where the heap in use must not grow.
"""

import gc
import random

from kickstand_tools.simulated_board.radio import Radio
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted.sensor_errors import Sensor
from support.device_runs import standing
from support.simulated_phones import PLACES, Phone

WARM = 200  # number of acts until all modules are imported and every buffer has its final size
ACTS = 400
GROWTH = 2048  # bytes of heap that the garbage collector may miss


def used():
    """Return the bytes of MicroPython's heap in use, or 0 on CPython."""
    gc.collect()
    gc.collect()
    return getattr(gc, "mem_alloc", int)()  # CPython has no mem_alloc(); int() is 0


class Forgetful(Phone):
    """A phone that stores nothing it receives."""

    def heard(self, handle, data):
        self.packets = [data]

    def dropped(self):
        pass


def nonsense(dice):
    """Return the bytes of a random write: two commands with random arguments, or random bytes of any length."""
    kind = dice.randrange(6)
    if kind == 0:
        return bytes([1, 0, dice.randrange(256)])
    if kind == 1:
        return bytes([2, dice.randrange(256), dice.randrange(256), 0, 0, 0, dice.randrange(6)])
    return bytes([dice.randrange(256) for _ in range(dice.randrange(30))])


def act(dice, phone, radio):
    """Do one random act."""
    kind = dice.randrange(12)
    if radio.phone is None:
        phone.connect(dice.randrange(256))
    elif kind == 0:
        phone.leave()
    elif kind == 1:
        phone.away(bool(dice.randrange(2)))
    elif kind == 2:
        phone.read(dice.choice(sorted(PLACES)))
    elif kind == 3:  # a phone writes faster than the loop reads
        for _ in range(40):
            phone.write("filter", nonsense(dice))
    elif kind == 4:  # the phone disconnects and connects again between two passes of the loop
        phone.leave()
        radio.found = radio.found or b""
        phone.connect(dice.randrange(256))
    else:
        phone.write(dice.choice(("filter", "rate", "now", "board")), nonsense(dice))


def test_random_acts_of_a_phone_do_no_harm():
    # An ESP32's radio drops the packets that it cannot send. A Pico W's radio keeps the packets that it cannot send.
    for drops in (True, False):
        board = Board(Sensor(seed=3).world(standing([[0, 10]])))
        board.radio = radio = Radio(board.clock, drops)
        with board:
            run(board, radio)


def run(board, radio):
    from kickstand import devices
    from kickstand.app import App
    from kickstand.live import live, radio as live_radio
    from kickstand.settings import Settings

    dice = random
    dice.seed(7)
    marks = []

    def go():
        chosen = Settings(type("Config", (), {"LIVE": True}))
        app = App(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen))
        live.attach(live_radio.Radio(None), app)
        phone = Forgetful(board)
        for count in range(WARM + ACTS):
            if count == WARM:
                marks.append(used())
            act(dice, phone, radio)
            assert len(getattr(app, "live").radio.inbox) <= live_radio.MOST_WRITES  # noqa: B009 set by attach()
            for _ in range(dice.randrange(1, 12)):
                app.turn()
                board.clock.advance(10_000)
        marks.append(used())
        if radio.phone is not None:
            phone.leave()
        for _ in range(110):
            app.turn()
            board.clock.advance(10_000)
        assert radio.found is not None  # the next phone can find the board
        assert phone.connect() and phone.write("rate", b"\x28\x00")
        for _ in range(50):
            app.turn()
            board.clock.advance(10_000)
        assert app.sensor.fault is None and len(phone.packets[0]) in (14, 20)

    assert board.run(go, 10_000.0) == "returned"
    assert marks[1] - marks[0] < GROWTH, marks
