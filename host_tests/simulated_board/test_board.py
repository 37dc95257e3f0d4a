"""The simulated board: clock, power, watchdog, files, pins, timer, radio, and the fakes of MicroPython's modules."""

import pytest
from kickstand_sim.simulated_board.clock import Clock, PowerOff
from kickstand_sim.simulated_board.fakes import fake_bluetooth, fake_machine, fake_time
from kickstand_sim.simulated_board.fakes.fake_machine import WDT
from kickstand_sim.simulated_board.radio import EVENT_S, ROOM, Radio
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level, on_board, raised


def test_the_deadline_stops_the_clock_and_stays():
    """An event at the deadline still happens. Firmware that catches every Exception cannot catch PowerOff."""
    clock, events = Clock(), []
    clock.set_deadline(500)
    clock.at(500, lambda: events.append(1))
    for us in (1000, 1):
        assert isinstance(raised(clock.advance, us), PowerOff) and clock.now_us == 500 and events == [1]
    clock.set_deadline(None)
    clock.advance(1)
    assert clock.now_us == 501 and not issubclass(PowerOff, Exception)


def test_ticks_wrap_as_on_the_boards():
    def program():
        first = fake_time.ticks_us()
        fake_time.sleep_ms(2)
        last = fake_time.ticks_us()
        assert first > last, "no wrap within the 2 ms"
        assert fake_time.ticks_diff(last, first) == -fake_time.ticks_diff(first, last) == 2000 + fake_time.CALL_US
        assert fake_time.ticks_add(first, 2000 + fake_time.CALL_US) == last
        assert fake_time.ticks_add(last, -2000 - fake_time.CALL_US) == first

    board = Board(level)
    board.ticks_at_boot_us = (1 << 30) - 1000
    with board:
        assert board.run(program, 1.0) == "returned"


def test_power_is_lost_by_off_and_kept_by_reset():
    states = []

    def program():
        states.append((board.sensor.peek(0x1B), fake_machine.reset_cause(), fake_time.ticks_ms(), board.lcd.on))
        board.clock.advance(200_000)
        board.sensor.start(0x68, False)
        for value in (0x1B, 0x18):
            board.sensor.write_byte(value)
        board.lcd.on = True
        if len(states) == 1:
            fake_machine.reset()
        fake_time.sleep_ms(60_000)

    with Board(level) as board:
        assert [board.run(program, until_s) for until_s in (1.0, 2.0)] == ["reset", "off"] and not board.lcd.on
        assert board.run(program, 3.0) == "off"
    power_on, watchdog = fake_machine.PWRON_RESET, fake_machine.WDT_RESET
    assert states == [(0, power_on, 0, False), (0x18, watchdog, 0, True), (0, power_on, 0, False)]
    assert board.boots == 3 and board.clock.now_us == 3_000_000


def test_watchdogs_and_what_stops_them():
    def wait(ms, fed=0, stop=False):
        def program(board):
            watchdog = WDT(timeout=ms)
            for _ in range(fed):
                fake_time.sleep_ms(900)
                watchdog.feed()
            if stop:
                fake_machine.mem32[0x40058000 + 0x3000] = 1 << 30
            fake_time.sleep_ms(60_000_000 if ms > 9000 else 3000)

        return program

    for program, port, outcome in (
        (wait(1000), "rp2", "reset"),
        (wait(4000, fed=9), "rp2", "returned"),
        (wait(1000, stop=True), "rp2", "returned"),
        (wait(12 * 86_400_000), "esp32", "returned"),
        (wait(13 * 86_400_000), "esp32", "reset"),  # an ESP32 counts in 32 bits
    ):
        assert on_board(program, 100_000.0, port=port)[0] == outcome


def test_the_power_is_cut_in_the_middle_of_a_file(tmp_path):
    def program(board):
        board.faults.cut_file(".cal", 3)
        for name, parts in (("a.txt", ("text",)), ("a.cal", ("ab", "cdef"))):
            with open(tmp_path / name, "w") as file:
                for part in parts:
                    file.write(part)

    outcome, board = on_board(program)
    assert (outcome, board.faults.files_cut) == ("off", 1)
    assert ((tmp_path / "a.txt").read_text(), (tmp_path / "a.cal").read_text()) == ("text", "abc")


class Phone:
    def __init__(self):
        self.packets, self.drops = [], 0

    def heard(self, handle, data):
        self.packets.append((handle, data))

    def dropped(self):
        self.drops += 1


def connected(pairs=False, secret=None, **config):
    """Return a radio with a service, its clock, its phone, and the list of the events that the firmware gets."""
    clock, phone, events = Clock(), Phone(), []
    radio = Radio(clock, pairs)

    def irq(event, data):
        events.append((event, *data))
        return secret if event == 29 else None

    vars(radio).update(irq=irq, config=config, active=True)
    uuid = fake_bluetooth.UUID
    radio.register([(uuid(0x180F), [(uuid(1), 0x02 | 0x08), (uuid(2), 0x02 | 0x0200)])])
    assert not radio.connect(phone)  # the radio does not advertise yet
    vars(radio).update(found=b"advertised")
    assert radio.connect(phone) and not radio.connect(Phone())
    return radio, clock, phone, events


def handles(radio):
    (_, ((_, _, first), (_, _, second))) = radio.services[0]
    return first, second


def test_a_phone_connects_writes_hears_and_disconnects():
    """The numbers of the events are those of MicroPython's `bluetooth`. Notifications come with the next connection
    event, and wait while the phone is out of reach."""
    radio, clock, phone, events = connected()
    first, second = handles(radio)
    assert events == [(1, 0, 0, b"\x01\x02\x03\x04\x05\x06")]
    assert radio.services == [(0x180F, [(1, 0x0A, first), (2, 0x0202, second)])] and first != second
    assert radio.write(first, bytes(range(30))) and events[-1] == (3, 0, first)
    assert radio.read(first) == bytes(range(20)) and not radio.write(second, b"x") and radio.read(second) is None
    for data, away, wait_us, count in (
        (b"a", False, round(EVENT_S * 1e6) - 1, 0),
        (None, False, 1, 1),
        (b"b", True, round(EVENT_S * 1e6), 1),
        (None, False, round(EVENT_S * 1e6), 2),
    ):
        radio.away = away
        if data:
            radio.notify(first, data)
        clock.advance(wait_us)
        assert len(phone.packets) == count
    assert phone.packets == [(first, b"a"), (first, b"b")]
    radio.drop()
    assert events[-1][0] == 2 and phone.drops == 1 and radio.phone is None and radio.connections == 1


@pytest.mark.parametrize(("pairs", "count"), [(True, ROOM), (False, 50)])
def test_an_esp32_keeps_few_notifications(pairs, count):
    radio = connected(pairs)[0]
    assert [radio.notify(handles(radio)[0], b"x") for _ in range(50)].count(True) == count


def test_a_phone_that_knows_the_pin_pairs_and_is_known_again():
    radio, _, _, events = connected(True, mitm=True, bond=True)
    second = handles(radio)[1]
    assert events[0] == (29, 2, 0, b"\x01\x02\x03\x04\x05\x06") and not radio.paired
    radio.take_passkey(123456)
    assert not radio.give_pin(111111) and events[-1] == (31, 0, 3, 0) and radio.read(second) is None
    assert radio.give_pin(123456) and events[-1] == (30, 2, b"\x01\x02\x03\x04\x05\x06", b"\x00key")
    assert radio.read(second) == b""
    assert connected(True, secret=b"key", bond=True)[0].paired and not connected(True, secret=b"key")[0].paired
