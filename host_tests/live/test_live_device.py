"""The board sends its lean to a simulated phone. The phone decodes the packets as firmware/docs/live.md says."""

import itertools
import random

import pytest
from support.engines import ENGINES
from support.radio_decoder import channels, own

ASK = [[3.0, "connect"], [3.1, "write", "rate", [40, 0]]]
ALL = ["write", "filter", [1, 0, 100]]
STILL = {"lean": [[0, 25]]}


def of(phone, name, since_s=0.0, until_s=1e9):
    return [(t_s, data) for t_s, kind, data in phone["packets"] if kind == name and since_s <= t_s <= until_s]


def answers(phone, name):
    return [answer for _, act, answer in phone["said"] if act == name]


def latest(phone, name, t_s):
    return of(phone, name, until_s=t_s)[-1][1]


@pytest.mark.parametrize("engine", ENGINES)
def test_our_page_gets_every_packet_without_side_effects(engine, run, on_the_road):
    plan, times = on_the_road
    record = run(plan, ASK + [[4.5, "read", "board"], [4.5, "read", "ride"]], engine=engine, RECORD=True)
    (phone,) = record.phones
    assert record.ends == ["off"]
    board, ride = answers(phone, "read")
    assert board[0] == 1 and bytes(board[1:]).decode().startswith("Kickstand 1A2B, ")
    assert own("ride", ride)["version"] == 1
    stamps = [own("now", data)["time of the board"] for _, data in of(phone, "now")]
    steps = [(b - a) % 65536 for a, b in itertools.pairwise(stamps)]
    assert len(steps) > 550 and 30 <= min(steps) and max(steps) <= 130  # the longest step is during an erase of flash
    for t_s in times:
        packet = own("now", latest(phone, "now", t_s))
        assert abs(packet["lean"] / 100 - record.lean_at(t_s)) <= 1
        assert packet["state"] == 1 + 2 + 16 and packet["speed"] is None
    ride = own("ride", latest(phone, "ride", 26.9))
    assert 280 < ride["largest lean to the left"] < 320 and 380 < ride["to the right"] < 420
    assert ride["samples lost"] == 0


ASK_ALL = [[2.0, "connect"], [2.1, "write", "rate", [40, 0]], [2.1, "write", "filter", [1, 0, 40]]]


def test_lean_that_is_not_trusted_is_never_a_number(run, on_the_road):
    """The sensor is lost for two seconds. After that the lean is not sure yet."""
    record = run({**on_the_road[0], "faults": [["unplug_sensor", [10.0, 2.0]]], "until": 20}, ASK_ALL)
    (phone,) = record.phones
    assert not of(phone, "now", 10.2, 12) and not of(phone, "chrono", 10.2, 12)
    assert own("ride", latest(phone, "ride", 11.9))["state"] & (64 + 2) == 64
    assert record.at(13.0) == record.at(16.0) == ["Lean  --        ", "not sure yet    "]
    packets = [own("now", data) for _, data in of(phone, "now")]
    assert all((packet["lean"] is None) == (not packet["state"] & 2) for packet in packets)
    assert {own("now", data)["lean"] for _, data in of(phone, "now", 13.0, 16.0)} == {None}
    assert packets[-1]["lean"] > 3500


def test_second_phone_waits_for_the_first(run):
    """The board forgets the requests of the first phone, and disconnects a phone that requests nothing for a minute.
    The display shows which phone is connected."""
    first = [[4.0, "connect", 1], [4.1, *ALL], [8.0, "leave"]]
    second = [[6.0, "connect", 2], [9.5, "connect", 2], [12.0, "write", "rate", [100, 0]], [15.0, "leave"]]
    third = [[17.0, "connect", 3]]
    record = run({**STILL, "turn_to": [[1.5, "live"]], "until": 80}, first, second, third)
    first_phone, two, three = record.phones
    assert 70 <= len(of(first_phone, "chrono")) <= 80 and not of(first_phone, "now")
    assert answers(two, "connect") == [False, True]
    assert not of(two, "chrono") and not of(two, "now", until_s=12) and 27 <= len(of(two, "now")) <= 31
    assert answers(three, "connect") == [True]
    dropped_s = [t_s for t_s, act, _ in three["said"] if act == "dropped"]
    assert len(dropped_s) == 1 and 77 < dropped_s[0] < 80
    lines = [record.at(t_s)[0] for t_s in (3.9, 7.0, 11.0, 14.0)]
    assert lines == ["BLE     no phone", "BLE   RaceChrono", "BLE      a phone", "BLE      browser"]
    assert record.at(7.0)[1].split() == ["20", "packets/s"]


def test_car_has_no_lean_and_its_speed(run):
    ride = [["straight", 3.0], ["accelerate", 12.0, 4.0], ["straight", 60.0]]
    record = run({"ride": ride, "gps": {}, "until": 14}, ASK + [[3.2, *ALL]], VEHICLE="car", SPEED="gps")
    (phone,) = record.phones
    packet = own("now", latest(phone, "now", 13))
    assert packet["lean"] is None and packet["state"] & 32 and abs(packet["speed"] - 1200) < 30
    values = {}
    for _, data in of(phone, "chrono", 11):
        values.update(channels(data))
    assert abs(values["speed"] - 12) < 0.3 and "lean angle" not in values


@pytest.mark.parametrize("engine", ENGINES)
def test_random_acts_of_a_phone_do_no_harm(engine, run):
    """Half of the writes are commands with random arguments, half are random bytes. The queue of an ESP32 overflows."""
    dice, acts = random.Random(7), [[1.9, "connect"]]
    for k in range(400):
        command = [[1, 0], [2, dice.randrange(256), 0, 0, 0, 0], []][dice.randrange(3)]
        data = command + [dice.randrange(256) for _ in range(1 if command else dice.randrange(30))]
        act = ["write", dice.choice(("filter", "rate", "now", "board")), data]
        act = dice.choice([["connect"], ["leave"], ["read", "ride"], ["away", True], ["away", False], *[act] * 5])
        acts.append([2.0 + 0.02 * (k // 2), *act])
    last = [[7.0, "leave"], [7.0, "away", False], [9.0, "connect"], [9.1, "write", "rate", [40, 0]]]
    record = run({**STILL, "board": {"machine": "esp32"}, "until": 12}, acts + last, engine=engine)
    assert record.ends == ["off"] and record.lean_at(11.5) == 25
    assert len(of(record.phones[0], "now", 10.0, 12.0)) > 30


@pytest.mark.parametrize(
    ("machine", "config", "lines", "words"),
    [
        ("pico", {}, ["No Bluetooth    ", "on this board   "], "has no Bluetooth"),
        ("pico w", {"LIVE_PIN": 271828}, ["LIVE_PIN: not   ", "on this board   "], "cannot ask for a PIN"),
    ],
)
def test_board_without_radio_says_so_and_shows_the_lean(machine, config, lines, words, run):
    record = run({**STILL, "board": {"machine": machine}, "until": 5}, **config)
    assert lines in [frame[1:] for frame in record.frames]
    assert record.console.count(words) == 1
    assert record.lean_at(4.5) == 25


def test_pin_is_required_once_per_phone(run):
    """The phone stays paired after power-off. After a change of the PIN it must pair again."""
    stranger = [[2.0, "connect", 1], [2.1, "write", "rate", [40, 0]], [2.2, "read", "ride"], [2.3, "read", "board"]]
    stranger += [[2.4, "give_pin", 314159], [2.5, "write", "filter", [1, 0, 40]], [4, "leave"]]
    owner = [[6.0, "connect", 2], [6.1, "give_pin", 271828], [6.2, "write", "rate", [40, 0]], [9.0, "leave"]]
    owner += [[14.0, "connect", 2], [14.1, "write", "rate", [40, 0]]]
    plan = {**STILL, "board": {"machine": "esp32"}}
    record = run({**plan, "power": [11], "until": 16}, stranger, owner, LIVE_PIN=271828)
    outside, inside = record.phones
    assert answers(outside, "write") == [False, False] and answers(outside, "read") == [None, None]
    assert answers(outside, "give_pin") == [False] and outside["packets"] == []
    assert answers(inside, "give_pin") == [True] and answers(inside, "write") == [True, True]
    assert of(inside, "now", 6, 10) and of(inside, "now", 14.2)
    later = run({**plan, "until": 5}, ASK, LIVE_PIN=141421)
    assert answers(later.phones[0], "write") == [False]
