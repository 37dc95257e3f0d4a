"""The whole device sends its lean to a simulated phone. The phone decodes the packets as firmware/docs/live.md says."""

import collections
import itertools
import sys

import pytest
from support import device_plans
from support.device_runs import Device, world_of
from support.engines import ENGINES
from support.radio_decoder import channels, own

LIVE = {"config": {"LIVE": True, "RECORD": True}, "board": {"machine": "pico w"}}
ASK = [[20.0, "connect"], [20.1, "write", "rate", [40, 0]]]


def of(phone, name, since=0.0, until=1e9):
    return [(t_s, data) for t_s, kind, data in phone["packets"] if kind == name and since <= t_s <= until]


def answers(phone, name):
    return [answer for _, did, answer in phone["said"] if did == name]


def last(phone, name, t_s):
    return [data for sent_s, data in of(phone, name, until=t_s)][-1]


@pytest.fixture
def run(request, tmp_path, capsys):
    return lambda plan: device_plans.run(getattr(request, "param", "cpython"), tmp_path, plan, capsys)


def test_racechrono_gets_the_requested_packets(run):
    """The phone first denies all packets, and then requests two of them at two rates. The packets have the values of
    the display. Later the phone denies all packets again, and then allows all."""
    acts = [[20.0, "connect"], [20.1, "write", "filter", [0]], [20.1, "write", "filter", [2, 0, 100, 0, 0, 0, 1]]]
    acts += [[20.2, "write", "filter", [2, 0, 40, 0, 0, 0, 2]], [20.2, "write", "filter", [2, 0, 40, 0, 0, 0, 77]]]
    acts += [[40.0, "write", "filter", [0]], [42.0, "write", "filter", [1, 0, 100]]]
    record = run({**device_plans.ALIGNED, **LIVE, "phones": [acts]})
    (phone,) = record.phones
    sent = of(phone, "chrono")
    counts = collections.Counter(data[0] for t_s, data in sent if t_s < 40)
    assert 195 <= counts[1] <= 200 and 490 <= counts[2] <= 496 and not counts[3]
    assert not [t_s for t_s, _ in sent if 40.1 < t_s < 42]
    again = collections.Counter(data[0] for t_s, data in sent if t_s >= 42)
    assert 38 <= again[1] <= 41 and again[1] == again[2]
    for t_s in (device_plans.LEFT_S, device_plans.RIGHT_S, 43.9):
        heard = {}
        for sent_s, data in sent:
            if sent_s <= t_s:
                heard.update(channels(data))
        assert abs(heard["lean angle"] - record.lean_at(t_s)) <= 1
        assert 0 < heard["its standard deviation"] < 3 and heard["1 while the lean is trusted"] == 1
    right = {}
    for sent_s, data in sent:
        if sent_s <= device_plans.RIGHT_S:
            right.update(channels(data))
    assert -40 < right["yaw rate"] < -15 and 1.1 < right["vertical acceleration (specific force)"] < 1.5
    assert abs(right["roll rate"]) < 8 and abs(right["longitudinal acceleration"]) < 0.2


@pytest.mark.parametrize("run", ENGINES, indirect=True)
def test_our_page_gets_every_packet_without_side_effects(run):
    record = run({**device_plans.ALIGNED, **LIVE, "phones": [ASK + [[21.5, "read", "board"], [21.5, "read", "ride"]]]})
    (phone,) = record.phones
    assert record.ends == ["off"]
    board, ride = answers(phone, "read")
    assert board[0] == 1 and bytes(board[1:]).decode().startswith("Kickstand 1A2B, ")
    assert own("ride", ride)["version"] == 1
    now = [own("now", data) for _, data in of(phone, "now")]
    assert len(now) > 600
    steps = [(b["time of the board"] - a["time of the board"]) % 65536 for a, b in itertools.pairwise(now)]
    assert 30 <= min(steps) and max(steps) <= 130  # the longest step is during an erase of the flash
    for t_s in (device_plans.LEFT_S, device_plans.RIGHT_S, device_plans.STRAIGHT_S):
        seen = own("now", last(phone, "now", t_s))
        assert abs(seen["lean"] / 100 - record.lean_at(t_s)) <= 1
        assert seen["state"] == 1 + 2 + 16 and seen["speed"] is None
    end = own("ride", last(phone, "ride", 45.9))
    assert 280 < end["largest lean to the left"] < 320 and 380 < end["to the right"] < 420
    assert end["samples lost"] == 0


def test_a_lean_that_is_not_trusted_is_never_a_number(run):
    """At first there is no alignment, and later no sensor. At these times no packet contains a lean."""
    acts = [[3.0, "connect"], [3.1, "write", "rate", [40, 0]], [3.1, "write", "filter", [1, 0, 40]]]
    faults = [["unplug_sensor", [30.0, 4.0]]]
    plan = {**device_plans.ALIGNED, **LIVE, "phones": [acts], "until": 40}
    record = run({**plan, "faults": faults})
    (phone,) = record.phones
    aligned_s = record.first("Aligned")
    assert aligned_s < 20
    for t_s, data in of(phone, "now", until=aligned_s - 0.2):
        seen = own("now", data)
        assert (seen["lean"], seen["its standard deviation"], seen["specific force to the left"]) == (None,) * 3, t_s
        assert seen["about up (yaw)"] is None and not seen["state"] & 3
    assert not of(phone, "chrono", until=aligned_s - 0.2)
    while_gone = [data for _, data in of(phone, "now", 30.2, 34)] + [data for _, data in of(phone, "chrono", 30.2, 34)]
    assert not while_gone
    assert own("ride", last(phone, "ride", 33))["state"] & (64 + 2) == 64
    unsure = [
        own("now", data)["lean"]
        for t_s, data in of(phone, "now", 34.5)
        if {record.at(t_s + apart)[0].rstrip(" *") for apart in (-0.2, 0.0, 0.2)} == {"Lean  --"}
    ]
    assert len(unsure) > 10 and set(unsure) == {None}
    for t_s, data in of(phone, "now", 20):
        seen = own("now", data)
        assert (seen["lean"] is None) == (not seen["state"] & 2), t_s


def test_the_second_phone_waits_for_the_first(run):
    """The second phone can connect only after the first has left. The board forgets the requests of the first phone.
    The board disconnects a phone that requests nothing. The display shows which phone is connected."""
    first = [[22.0, "connect", 1], [22.1, "write", "filter", [1, 0, 100]], [26.0, "leave"]]
    second = [[24.0, "connect", 2], [27.5, "connect", 2], [30.0, "write", "rate", [100, 0]], [33.0, "leave"]]
    third = [[35.0, "connect", 3]]
    plan = {**device_plans.ALIGNED, **LIVE, "phones": [first, second, third], "turn_to": [[18.0, "live"]], "until": 100}
    record = run(plan)
    one, two, three = record.phones
    assert 70 <= len(of(one, "chrono")) <= 80 and not of(one, "now")
    assert answers(two, "connect") == [False, True]
    assert not of(two, "chrono") and not of(two, "now", until=30) and 27 <= len(of(two, "now")) <= 31
    assert answers(three, "connect") == [True]
    dropped = [t_s for t_s, did, _ in three["said"] if did == "dropped"]
    assert len(dropped) == 1 and 95 < dropped[0] < 98
    shown = [record.at(t_s)[0] for t_s in (21.9, 25.0, 29.0, 32.0)]
    assert shown == ["BLE     no phone", "BLE   RaceChrono", "BLE      a phone", "BLE      browser"]
    assert record.at(25.0)[1].split() == ["20", "packets/s"]


def test_the_loop_continues_if_the_phone_is_out_of_reach(run):
    """While the phone is out of reach, the queue of an ESP32 is full. Packets are lost, but nothing else happens."""
    acts = ASK + [[25.0, "away", True], [29.0, "away", False]]
    plan = {**device_plans.ALIGNED, **LIVE, "board": {"machine": "esp32"}, "phones": [acts]}
    record = run(plan)
    (phone,) = record.phones
    assert not of(phone, "now", 25.1, 28.9)
    assert len(of(phone, "now", 29.5)) > 390
    assert own("ride", last(phone, "ride", 45.9))["samples lost"] == 0
    assert abs(record.lean_at(27.0) + 30) <= 1


def test_the_menu_switches_live_off(run):
    """The rider presses to move from the entry "Reset maxima" to the entry before the last."""
    presses = device_plans.PRESSES + [[22.0, 1.0]] + [[23.5 + 0.4 * k, 0.15] for k in range(5)] + [[26.0, 1.0]]
    record = run(
        {**device_plans.ALIGNED, **LIVE, "phones": [ASK + [[40.0, "found"], [41.0, "connect"]]], "presses": presses}
    )
    (phone,) = record.phones
    assert [did for _, did, _ in phone["said"]].count("dropped") == 1
    assert not of(phone, "now", 28) and answers(phone, "found") == [None]
    assert answers(phone, "connect") == [True, False]
    assert abs(record.lean_at(device_plans.RIGHT_S) - 40) <= 1


def test_a_car_has_no_lean_and_its_speed(run):
    acts = [[10.0, "connect"], [10.1, "write", "rate", [40, 0]], [10.2, "write", "filter", [1, 0, 100]]]
    ride = [["straight", 5.0], ["accelerate", 12.0, 6.0], ["straight", 12.0]]
    plan = {"ride": ride, "gps": {}, "until": 22, "phones": [acts], "board": {"machine": "pico w"}}
    record = run({**plan, "config": {"LIVE": True, "VEHICLE": "car", "SPEED": "gps"}})
    (phone,) = record.phones
    seen = own("now", last(phone, "now", 21))
    assert seen["lean"] is None and seen["state"] & 32 and abs(seen["speed"] - 1200) < 30
    heard = [channels(data) for _, data in of(phone, "chrono", 18)]
    assert {name for one in heard for name in one} == {"speed"}
    assert abs(heard[-1]["speed"] - 12) < 0.3


@pytest.mark.parametrize(
    ("machine", "config", "shown", "said"),
    [
        ("pico", {}, ["No Bluetooth    ", "on this board   "], "has no Bluetooth"),
        ("pico w", {"LIVE_PIN": 271828}, ["LIVE_PIN: not   ", "on this board   "], "cannot ask for a PIN"),
    ],
)
def test_a_board_without_radio_says_so_and_shows_the_lean(run, machine, config, shown, said):
    plan = {**device_plans.ALIGNED, "config": {"LIVE": True, **config}, "board": {"machine": machine}}
    record = run({**plan, "until": 32})
    assert shown in [frame[1:] for frame in record.frames]
    assert record.console.count(said) == 1
    assert abs(record.lean_at(device_plans.LEFT_S) + 30) <= 1


def test_the_pin_is_required_once_per_phone(run):
    """The phone stays paired after power-off. After a change of the PIN the phone must pair again."""
    stranger = [[20.0, "connect", 1], [20.1, "write", "rate", [40, 0]], [20.2, "read", "ride"], [20.3, "read", "board"]]
    stranger += [[20.4, "give_pin", 314159], [20.5, "write", "filter", [1, 0, 40]], [22, "leave"]]
    owner = [[24.0, "connect", 2], [24.1, "give_pin", 271828], [24.2, "write", "rate", [40, 0]], [28.0, "leave"]]
    owner += [[40.0, "connect", 2], [40.1, "write", "rate", [40, 0]]]
    plan = {**device_plans.ALIGNED, **LIVE, "phones": [stranger, owner], "board": {"machine": "esp32"}, "power": [30]}
    plan["config"] = {"LIVE": True, "LIVE_PIN": 271828}
    record = run(plan)
    outside, inside = record.phones
    assert answers(outside, "write") == [False, False] and answers(outside, "read") == [None, None]
    assert answers(outside, "give_pin") == [False] and outside["packets"] == []
    assert answers(inside, "give_pin") == [True] and answers(inside, "write") == [True, True]
    assert of(inside, "now", 24, 28) and of(inside, "now", 40.2)
    later = run({**plan, "power": [], "until": 22, "config": {"LIVE": True, "LIVE_PIN": 141421}, "phones": [ASK]})
    assert answers(later.phones[0], "write") == [False]


def test_with_live_off_nothing_more_is_imported(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    device = Device(world_of(device_plans.ALIGNED)[0], machine="pico w")
    seen = set()
    device.board.at(8.0, lambda: seen.update(sys.modules))
    device.run({}, [9.0])
    assert "kickstand.app" in seen and not [name for name in seen if name.startswith("kickstand.live")]
