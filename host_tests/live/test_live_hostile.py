"""A phone connects, writes and disconnects at random, hundreds of times. Most writes are invalid. The device continues,
and on MicroPython the heap in use does not grow. The file runs as a script there."""

import gc
import random
import sys

from kickstand_tools.simulated_board.radio import Radio
from kickstand_tools.simulated_board.simulator import Board
from support.board_access import rough
from support.simulated_phones import PLACES, Phone

WARM = 100  # number of acts until all modules are imported and every buffer has its final size
ACTS = 200
GROWTH = 2048  # bytes of heap that the garbage collector may miss


def heap_bytes():
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


def act(dice, phone, radio):
    """Do one random act. Half of the writes are commands with random arguments, half are random bytes."""
    command = [[1, 0], [2, dice.randrange(256), 0, 0, 0, 0], []][dice.randrange(3)]
    data = bytes(command + [dice.randrange(256) for _ in range(1 if command else dice.randrange(30))])
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
            phone.write("filter", data)
    elif kind == 4:  # the phone disconnects and connects again between two passes of the loop
        phone.leave()
        radio.found = radio.found or b""
        phone.connect(dice.randrange(256))
    else:
        phone.write(dice.choice(("filter", "rate", "now", "board")), data)


def turns(board, app, count):
    for _ in range(count):
        app.turn()
        board.clock.advance(10_000)


def act_at_random(board, radio):
    from kickstand import devices
    from kickstand.app import App
    from kickstand.live import live, radio as live_radio
    from kickstand.settings import Settings

    random.seed(7)
    settings = Settings(type("Config", (), {"LIVE": True}))
    app = App(settings, devices.open_lcd(settings), devices.open_sensor(settings))
    live.attach(live_radio.Radio(None), app)
    phone = Forgetful(board)
    used = 0
    for count in range(WARM + ACTS):
        if count == WARM:
            used = heap_bytes()
        act(random, phone, radio)
        turns(board, app, random.randrange(1, 12))
    assert heap_bytes() - used < GROWTH
    if radio.phone is not None:
        phone.leave()
    turns(board, app, 110)
    assert radio.found is not None  # the next phone can find the board
    assert phone.connect() and phone.write("rate", b"\x28\x00")
    turns(board, app, 50)
    assert app.sensor.fault is None and len(phone.packets[0]) in (14, 20)


def run(drops):
    """drops: True for the radio of an ESP32, which drops the packets that it cannot send. A Pico W's radio keeps
    them."""
    board = Board(rough)
    board.radio = radio = Radio(board.clock, drops)
    with board:
        assert board.run(lambda: act_at_random(board, radio), 10_000.0) == "returned"


if sys.implementation.name == "micropython":
    run(True)
    run(False)
else:
    from pathlib import Path

    import pytest

    @pytest.mark.parametrize("drops", [True, False])
    def test_random_acts_of_a_phone_do_no_harm(drops):
        run(drops)

    def test_random_acts_take_no_heap_on_micropython():
        from support.mpy import BOARD_HEAP, run_mpy

        run_mpy(Path(__file__), heap=BOARD_HEAP)
