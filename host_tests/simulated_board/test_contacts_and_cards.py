"""The models of button, wheel, SD card, GPS receiver, other devices, and of each chip's pins, against known numbers."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.contacts import Button, Wheel
from kickstand_tools.simulated_board.fakes import chips
from kickstand_tools.simulated_board.gps import Gps, sentence
from kickstand_tools.simulated_board.other_devices import Ds3231, Registers
from kickstand_tools.simulated_board.sd_card import SdCard
from support.board_access import read, write


def edges(contact, clock, until_us):
    """Return the edges of a contact as [(time in us, level of the pin)]."""
    changes = []
    contact.connect(lambda level: changes.append((clock.now_us, level)))
    clock.advance(until_us - clock.now_us)
    return changes


def press(seed=1):
    clock = Clock()
    button = Button(clock, seed)
    button.press(10_000, 100_000)
    return button, edges(button, clock, 200_000)


def test_a_button_bounces_for_4_ms_and_then_stays():
    button, changes = press()
    assert [level for _, level in changes] == [0, 1, 0, 1, 0, 1, 0] + [1, 0, 1, 0, 1, 0, 1] and not button.closed
    for begin_us, part in ((10_000, changes[:7]), (110_000, changes[7:])):
        times = [time_us - begin_us for time_us, _ in part]
        assert times[0] == 0 and times == sorted(times) and 3600 < times[-1] <= 3996
        assert all(666 * k - 333 < time_us <= 666 * k for k, time_us in enumerate(times[1:], 1))
    assert changes == press()[1] != press(2)[1]


def test_presses_now_follow_each_other():
    clock = Clock()
    button = Button(clock)
    clock.advance(5000)
    for _ in range(2):
        button.press(None, 100_000)
    closings = [time_us for time_us, level in edges(button, clock, 1_000_000) if level == 0]
    assert closings[0] == 5000 and min(time_us for time_us in closings if time_us > 200_000) == 5000 + 250_000
    button.press(None, 1000)  # after the earlier presses, a press begins at once
    assert edges(button, clock, 1_000_001)[0] == (1_000_000, 0)


def test_a_capacitor_holds_the_pin_low():
    clock = Clock()
    button = Button(clock)
    button.charge_us = 300
    clock.advance(1000)
    assert [button.low(pulled_us) for pulled_us in (800, 700, 0)] == [True, False, False]
    button.closed = True
    assert button.low(0)


@pytest.mark.parametrize(
    ("speed", "per_metre", "count"), [(10.0, 0.5, 5), (20.0, 0.5, 10), (10.0, 2.0, 20), (0.02, 50.0, 0)]
)
def test_a_wheel_closes_once_per_turn(speed, per_metre, count):
    """The contact is closed for a tenth of the way between two pulses. At first the magnet is half a turn away."""
    clock = Clock()
    changes = edges(Wheel(clock, lambda t_s: speed, per_metre), clock, 1_000_000)
    closed, opened = ([time_us for time_us, level in changes if level == k] for k in (0, 1))
    assert abs(len(closed) - count) <= 1 and (len(closed) > 0) == (count > 0)
    if count:
        way_us = 1e6 / (speed * per_metre)
        assert closed[0] == pytest.approx(way_us / 2.0, rel=0.02)
        assert closed[1] - closed[0] == pytest.approx(way_us, rel=0.01)
        assert opened[0] - closed[0] == pytest.approx(0.1 * way_us, rel=0.01)


def test_a_wheel_follows_its_speed_bounces_breaks_and_picks_up_noise():
    clock = Clock()
    wheel = Wheel(clock, lambda t_s: 0.0 if t_s < 0.5 else 50.0)
    assert edges(wheel, clock, 499_999) == [] and 500_000 <= edges(wheel, clock, 600_000)[0][0] <= 541_000
    clock = Clock()
    changes = edges(Wheel(clock, lambda t_s: 10.0, bounce_us=400, until_s=0.4), clock, 1_000_000)
    begin_us = changes[0][0]
    assert [(t_us - begin_us, level) for t_us, level in changes[:5]] == [(100 * k, k % 2) for k in range(5)]
    assert max(time_us for time_us, level in changes if level == 0) < 400_000
    clock = Clock()
    wheel = Wheel(clock, lambda t_s: 0.0)
    wheel.noise_hz = 200
    assert sum(level == 0 for _, level in edges(wheel, clock, 1_000_000)) == pytest.approx(200, abs=6)


def exchanged(card, *values):
    return [card.exchange(bytes([value]))[0] for value in values]


def command(card, number, argument=0):
    """Send a command, and return the first byte of its answer."""
    card.select(1)
    card.select(0)
    card.exchange(bytes([0x40 | number]) + argument.to_bytes(4, "big") + b"\x95")
    return exchanged(card, 0xFF, 0xFF)[1]


def new_card(**kind):
    """Return an SD card and its clock, after its initialisation."""
    clock = Clock()
    card = SdCard(clock, **kind)
    assert command(card, 0) == 0x01
    clock.advance(100_000)
    return card, clock


def store(card, token, content):
    """Send a sector. Return the card's answer: 5 if it is accepted."""
    exchanged(card, token)
    card.exchange(content)
    exchanged(card, 0xFF, 0xFF)
    return exchanged(card, 0xFF)[0] & 0x1F


def test_a_card_answers_while_it_is_selected_ready_and_present():
    card, clock = new_card()
    assert command(card, 41) == 0x00
    command(card, 0)
    for wait_us, answer in ((99_999, 0x01), (1, 0x00)):
        clock.advance(wait_us)
        assert command(card, 41) == answer
    card.select(1)
    assert card.exchange(b"\x51\0\0\0\0\xff\xff") == b"\xff" * 7
    card.select(0)
    card.removed = True
    assert command(card, 17) == 0xFF
    assert command(new_card(init_s=None)[0], 41) == 0x01


def test_a_card_stores_sectors():
    card, clock = new_card()
    content = bytes(range(256)) * 2
    assert command(card, 24, 7) == 0x00 and store(card, 0xFE, content) == 5
    assert exchanged(card, 0xFF) == [0x00]  # busy
    clock.advance(2000)
    assert exchanged(card, 0xFF) == [0xFF] and card.data == {7: content}
    begin_us = clock.now_us
    assert command(card, 17, 7) == 0x00 and clock.now_us - begin_us == 500
    assert exchanged(card, 0xFF, 0xFF)[1] == 0xFE and card.exchange(b"\xff" * 512) == content
    assert command(card, 17, 8) == 0x00
    exchanged(card, 0xFF, 0xFF)
    assert card.exchange(b"\xff" * 512) == bytes(512)
    command(card, 25, 3)  # several sectors, until the stop token
    for value in (1, 2):
        assert store(card, 0xFC, bytes([value]) * 512) == 5
        clock.advance(2000)
    exchanged(card, 0xFD, 0xFF)
    assert exchanged(card, 0xFF) == [0x00]
    clock.advance(2000)
    assert {number: data[0] for number, data in card.data.items()} == {7: 0, 3: 1, 4: 2}


def test_a_card_may_reject_or_stay_busy():
    card, clock = new_card()
    card.rejects = 1
    vars(card)["busy_next_s"] = 0.5
    for answer in (0x0D, 0x05):
        command(card, 24, 1)
        assert store(card, 0xFE, b"x" * 512) == answer
        assert bool(card.data) is (answer == 0x05)
    clock.advance(499_999)
    assert exchanged(card, 0xFF) == [0x00]
    clock.advance(1)
    assert exchanged(card, 0xFF) == [0xFF] and card.busy_next_s is None


def test_a_cards_size_and_its_file_system():
    card, _ = new_card(sectors=4096)
    assert command(card, 9) == 0x00 and exchanged(card, 0xFF, 0xFF)[1] == 0xFE
    csd = card.exchange(b"\xff" * 16)
    assert csd == b"\x40" + bytes(6) + b"\x00\x00\x03" + bytes(6)  # the size is (3 + 1) * 512 KB
    assert exchanged(card, 0xFF, 0xFF, 0xFF) == [0xFF] * 3  # two bytes of check sum, and one after the data
    assert [card.ioctl(op, 0) for op in (4, 5, 1)] == [4096, 512, 0]
    card.writeblocks(2, b"a" * 512 + bytes(512) + b"c" * 512)
    assert sorted(card.data) == [2, 4]  # sectors of zeros are not stored
    buffer = bytearray(1024)
    card.readblocks(3, buffer)
    assert buffer == bytes(512) + b"c" * 512
    card.writeblocks(2, bytes(512))
    assert sorted(card.data) == [4]


def heard(seconds, **kind):
    """Return [(time of its last byte in s, sentence)] of a receiver."""
    clock, sentences, text = Clock(), [], []

    def receive(data):
        text.append(data)
        if b"\n" in data:
            *lines, rest = b"".join(text).decode("ascii", "replace").split("\r\n")
            sentences.extend((clock.now_us / 1e6, line) for line in lines)
            text[:] = [rest.encode()]

    Gps(clock, lambda t_s: 10.0 * t_s, **kind).connect(receive)
    clock.advance(round(seconds * 1e6))
    return sentences


def test_a_receiver_sends_each_fix_late_and_byte_by_byte():
    """The first sentence is from a real receiver."""
    body = "GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"
    assert sentence(body) == f"${body}*76\r\n"
    (time_s, rmc), (_, gsa), (last_s, vtg) = heard(2.0, place=lambda t_s: (-48.5, -11.25))
    assert rmc.startswith("$GPRMC,115941.00,A,4830.00000,S,01115.00000,W,19.438,84.4,211126,,,A*")
    assert gsa.startswith("$GPGSA,A,3,") and vtg.startswith("$GPVTG,84.4,T,,M,19.438,N,36.000,K,A*")
    size = sum(len(line) + 2 for line in (rmc, gsa, vtg))
    assert last_s == pytest.approx(1.0 + 0.2 + size * 10 / 9600, abs=0.001) and 1.2 < time_s < last_s
    faster = heard(1.5, hz=5, latency_s=0.05, baud=115_200, kinds=("RMC",), talker="GN")
    first = next(line for _, line in faster if "RMC" in line)
    assert first.startswith("$GNRMC,115940.20,A,4807.03800,N,01131.00000,E,3.888")
    assert faster[0][0] == pytest.approx(0.25, abs=0.02) and not any("VTG" in line for _, line in faster)
    assert len(faster) in (12, 14)


def test_a_receiver_may_have_no_fix_or_repeat_itself():
    faults = [["void", 2.0, 3.0], ["stuck", 4.0, 5.0]]
    fixes = [line for _, line in heard(6.6, kinds=("RMC",), faults=faults) if "RMC" in line]
    assert [line.split(",")[2] for line in fixes] == ["A", "V", "A", "A", "A", "A"]
    assert "V,,,,,,,211126,,,N*" in fixes[1] and fixes[3] == fixes[2] and fixes[4] != fixes[3]
    assert {int(time_s) for time_s, _ in heard(4.6, faults=[["unplugged", 1.9, 2.9]])} == {1, 3, 4}
    garbled = heard(3.6, kinds=("RMC",), faults=[["garbled", 2.0, 3.0]])
    valid = [line == sentence(line[1:-3]).strip() for _, line in garbled]
    assert valid[:2] == [True, True] and not all(valid)


def test_other_devices_keep_what_is_written():
    device = Registers(0x50, {0: 1, 1: 2, 2: 3}, writable=(1,))
    write(device, 1, 9, 9)
    assert read(device, 0, 3) == [1, 9, 3] and device.written == [1, 2]


def test_a_clock_at_the_sensors_address_counts_in_decimal_digits():
    clock = Clock()
    device = Ds3231(clock)
    for advance_s, digits in ((0, [0x15, 0x40, 0x11]), (50, [0x05, 0x41, 0x11]), (50_000, [0x25, 0x34, 0x01])):
        clock.advance(advance_s * 1_000_000)
        assert read(device, 0, 3) == digits


@pytest.mark.parametrize(
    ("name", "pins", "missing", "controllers", "bluetooth"),
    [
        ("pico", (0, 29), (30,), 2, False),
        ("pico w", (0, 29), (30,), 2, True),
        ("pico 2", (0, 29), (30,), 2, False),
        ("esp32", (0, 16, 23, 25, 27, 32, 39), (24, 28, 31, 40), 2, True),
        ("esp32 spiram", (15, 18), (16, 17), 2, True),
        ("s2", (0, 21, 33, 46), (22, 32, 47), 2, False),
        ("s3", (0, 21, 33, 48), (22, 32, 49), 2, True),
        ("s3 of 1.25", (0, 21, 33, 48), (22, 32, 49), 2, True),
        ("c3", (0, 10, 18, 21), (11, 17, 22), 1, True),
        ("c6", (0, 23), (24,), 1, True),
        ("h2", (0, 5, 8, 14, 22, 27), (6, 7, 15, 21, 28), 2, True),
    ],
)
def test_pins_and_parts_of_each_chip(name, pins, missing, controllers, bluetooth):
    machine = chips.MACHINES[name]
    assert set(pins) <= chips.pins_of(machine) and not set(missing) & chips.pins_of(machine)
    assert (chips.i2c_controllers(machine), chips.has_bluetooth(machine)) == (controllers, bluetooth)
    classic = name.startswith("esp32")
    assert chips.flash_pins(machine) == (frozenset(range(6, 12)) if classic else frozenset())
    assert chips.inputs_only(machine) == (frozenset(range(34, 40)) if classic else frozenset())
