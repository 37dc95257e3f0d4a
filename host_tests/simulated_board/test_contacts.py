"""The models of button, wheel and GPS receiver, and of each chip's pins, against known numbers."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.contacts import Button, Wheel
from kickstand_tools.simulated_board.fakes import chips
from kickstand_tools.simulated_board.gps import Gps, sentence


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
