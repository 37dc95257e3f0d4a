"""The models of contacts, the SD card and the chips' pins are compared with known numbers."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.contacts import Button, Wheel
from kickstand_tools.simulated_board.fakes import chips
from kickstand_tools.simulated_board.sd_card import SdCard


def edges(contact, clock, until_us):
    """Return the edges of a contact as [(time in us, level of the pin)]."""
    found = []
    contact.connect(lambda level: found.append((clock.now_us, level)))
    clock.advance(until_us - clock.now_us)
    return found


def test_a_button_bounces_for_4_ms_and_then_stays():
    clock = Clock()
    button = Button(clock)
    button.press(10_000, 100_000)
    found = edges(button, clock, 200_000)
    pressed, released = found[:7], found[7:]
    assert [level for _, level in pressed] == [0, 1, 0, 1, 0, 1, 0]
    assert [level for _, level in released] == [1, 0, 1, 0, 1, 0, 1]
    for part, begin_us in ((pressed, 10_000), (released, 110_000)):
        times = [at_us - begin_us for at_us, _ in part]
        assert times[0] == 0 and times == sorted(times) and 3600 < times[-1] <= 3996
        assert all(666 * k - 333 < at_us <= 666 * k for k, at_us in enumerate(times[1:], 1))
    assert not button.closed


def test_presses_now_follow_each_other():
    clock = Clock()
    button = Button(clock)
    clock.advance(5000)
    for _ in range(2):
        button.press(None, 100_000)
    found = [at_us for at_us, level in edges(button, clock, 1_000_000) if level == 0]
    assert found[0] == 5000 and min(at_us for at_us in found if at_us > 200_000) == 5000 + 100_000 + 150_000
    button.press(None, 1000)  # after the earlier presses, a press begins at once
    assert edges(button, clock, 1_000_001)[0] == (1_000_000, 0)


def test_other_seeds_bounce_at_other_times():
    times = []
    for seed in (1, 2, 1):
        clock = Clock()
        button = Button(clock, seed)
        button.press(0, 50_000)
        times.append(edges(button, clock, 100_000))
    assert times[0] == times[2] != times[1]


def test_a_capacitor_holds_the_pin_low():
    clock = Clock()
    button = Button(clock)
    button.charge_us = 300
    clock.advance(1000)
    assert button.low(800) and not button.low(700) and not button.low(0)
    button.closed = True
    assert button.low(0)


@pytest.mark.parametrize(
    ("speed", "per_metre", "count"), [(10.0, 0.5, 5), (20.0, 0.5, 10), (10.0, 2.0, 20), (0.02, 50.0, 0)]
)
def test_a_wheel_closes_once_per_turn(speed, per_metre, count):
    """The magnet closes the contact for a tenth of the way between two pulses. At first the magnet is half a turn
    away."""
    clock = Clock()
    wheel = Wheel(clock, lambda t_s: speed, per_metre)
    found = edges(wheel, clock, 1_000_000)
    closed = [at_us for at_us, level in found if level == 0]
    opened = [at_us for at_us, level in found if level == 1]
    assert abs(len(closed) - count) <= 1 and (len(closed) > 0) == (count > 0)
    if count:
        way_us = 1e6 / (speed * per_metre)
        assert closed[0] == pytest.approx(way_us / 2.0, rel=0.02)
        assert closed[1] - closed[0] == pytest.approx(way_us, rel=0.01)
        assert opened[0] - closed[0] == pytest.approx(0.1 * way_us, rel=0.01)


def test_a_wheel_follows_the_speed_within_20_ms():
    clock = Clock()
    wheel = Wheel(clock, lambda t_s: 0.0 if t_s < 0.5 else 50.0)
    assert edges(wheel, clock, 499_999) == []
    first, _ = edges(wheel, clock, 600_000)[0]
    assert 500_000 <= first <= 541_000


def test_a_wheel_may_bounce_break_or_pick_up_noise():
    clock = Clock()
    wheel = Wheel(clock, lambda t_s: 10.0, bounce_us=400, until_s=0.4)
    found = edges(wheel, clock, 1_000_000)
    begin = found[0][0]
    assert [(at_us - begin, level) for at_us, level in found[:5]] == [(0, 0), (100, 1), (200, 0), (300, 1), (400, 0)]
    assert max(at_us for at_us, level in found if level == 0) < 400_000
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
    answers = exchanged(card, 0xFF, 0xFF)
    return answers[1]


def card(**kind):
    """Return an SD card and its clock, after its initialisation."""
    clock = Clock()
    made = SdCard(clock, **kind)
    assert command(made, 0) == 0x01
    clock.advance(100_000)
    return made, clock


def test_a_card_is_ready_a_tenth_of_a_second_after_its_reset():
    made, clock = card()
    assert command(made, 41) == 0x00
    command(made, 0)
    clock.advance(99_999)
    assert command(made, 41) == 0x01
    clock.advance(1)
    assert command(made, 41) == 0x00
    never, clock = card(init_s=None)
    clock.advance(10_000_000)
    assert command(never, 41) == 0x01


def test_a_card_answers_only_while_it_is_selected():
    made, _ = card()
    made.select(1)
    assert made.exchange(b"\x51\0\0\0\0\xff\xff") == b"\xff" * 7
    made.select(0)
    made.removed = True
    assert command(made, 17) == 0xFF


def test_a_card_stores_sectors():
    made, clock = card()
    content = bytes(range(256)) * 2
    assert command(made, 24, 7) == 0x00
    exchanged(made, 0xFE)
    made.exchange(content)
    exchanged(made, 0xFF, 0xFF)
    assert exchanged(made, 0xFF)[0] & 0x1F == 0x05  # accepted
    assert exchanged(made, 0xFF)[0] == 0x00  # busy
    clock.advance(2000)
    assert exchanged(made, 0xFF)[0] == 0xFF
    assert made.data == {7: content}
    began_us = clock.now_us
    assert command(made, 17, 7) == 0x00 and clock.now_us - began_us == 500
    assert exchanged(made, 0xFF, 0xFF)[1] == 0xFE and made.exchange(b"\xff" * 512) == content
    assert command(made, 17, 8) == 0x00
    exchanged(made, 0xFF, 0xFF)
    assert made.exchange(b"\xff" * 512) == bytes(512)


def test_a_card_stores_several_sectors_until_the_stop_token():
    made, clock = card()
    command(made, 25, 3)
    for value in (1, 2):
        exchanged(made, 0xFC)
        made.exchange(bytes([value]) * 512)
        exchanged(made, 0xFF, 0xFF, 0xFF)
        clock.advance(2000)
    exchanged(made, 0xFD, 0xFF)
    assert exchanged(made, 0xFF)[0] == 0x00
    clock.advance(2000)
    assert {number: content[0] for number, content in made.data.items()} == {3: 1, 4: 2}


def test_a_card_may_reject_or_stay_busy():
    made, clock = card()
    made.rejects = 1
    for accepted in (False, True):
        command(made, 24, 1)
        exchanged(made, 0xFE)
        vars(made)["busy_next_s"] = 0.5
        made.exchange(b"x" * 512)
        exchanged(made, 0xFF, 0xFF)
        assert exchanged(made, 0xFF)[0] & 0x1F == (0x05 if accepted else 0x0D)
        assert bool(made.data) is accepted
    clock.advance(499_999)
    assert exchanged(made, 0xFF)[0] == 0x00
    clock.advance(1)
    assert exchanged(made, 0xFF)[0] == 0xFF and made.busy_next_s is None


def test_a_cards_size_is_in_its_csd():
    made, _ = card(sectors=4096)
    assert command(made, 9) == 0x00
    assert exchanged(made, 0xFF, 0xFF)[1] == 0xFE
    csd = made.exchange(b"\xff" * 16)
    assert int.from_bytes(csd[7:10], "big") == 3  # the size is (3 + 1) * 512 KB
    assert csd[0] == 0x40 and csd[1:7] == bytes(6) == csd[10:]
    assert exchanged(made, 0xFF, 0xFF, 0xFF) == [0xFF] * 3  # two bytes of check sum, and one after the data
    assert (made.ioctl(4, 0), made.ioctl(5, 0), made.ioctl(1, 0)) == (4096, 512, 0)
    made.writeblocks(2, b"a" * 512 + bytes(512) + b"c" * 512)
    assert sorted(made.data) == [2, 4]  # sectors of zeros are not stored
    buffer = bytearray(1024)
    made.readblocks(3, buffer)
    assert buffer == bytes(512) + b"c" * 512
    made.writeblocks(2, bytes(512))
    assert sorted(made.data) == [4]


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
