"""The models of button, wheel and GPS receiver, and of each chip's pins, against known numbers."""

import pytest
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.contacts import Button
from kickstand_sim.simulated_board.gps import Gps, sentence


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


def heard(seconds, **kind):
    """Return [(time of its last byte in s, sentence)] of a receiver."""
    clock, sentences, text = Clock(), [], []

    def receive(data):
        text.append(data)
        if b"\n" in data:
            *lines, tail = b"".join(text).decode("ascii", "replace").split("\r\n")
            sentences.extend((clock.now_us / 1e6, line) for line in lines)
            text[:] = [tail.encode()]

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
