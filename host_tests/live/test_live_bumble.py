"""The board on a virtual radio. Board and phone both use bumble's Bluetooth LE stack. The phone knows only what the
published documents say."""

import asyncio
import collections

import pytest
from support import device_plans
from support.device_runs import Device
from support.radio_decoder import channels

virtual_radio = pytest.importorskip("support.virtual_radio", reason="no bumble", exc_type=ImportError)

CHRONO = 0x1FF8


@pytest.fixture
def on_air(tmp_path, capsys):
    """Return run(plan, [(at_s, visit, pin), ...], machine, **config), which returns the Centrals and the Record."""
    device_plans.align(tmp_path)
    stations = []

    def run(plan, visits, machine, **config):
        device = Device(device_plans.world_of(plan)[0], machine=machine)
        air = virtual_radio.Air(device.board)
        stations.append(air)
        centrals = [virtual_radio.Central(air, pin).at(at_s, visit) for at_s, visit, pin in visits]
        with device_plans.on_flash(tmp_path):
            device.run({"LIVE": True, "SAMPLE_HZ": 100, **config}, [plan["until"]])
        return centrals, device_plans.Record(device.record(), capsys.readouterr().out)

    with virtual_radio.only_loop():
        yield run
        for air in stations:
            air.close()


async def ask_racechrono(central):
    """Like the app: find, subscribe, deny all packets, allow two at two rates. Later deny all, and then allow all."""
    await central.connect(await central.find(CHRONO))
    await central.subscribe(CHRONO, 0x0001, "chrono")
    counts = []
    for seconds, *commands in (
        (1, [0]),
        (18, [2, 0, 100, 0, 0, 0, 1], [2, 0, 40, 0, 0, 0, 2], [2, 0, 40, 0, 0, 0, 77]),
        (2, [0]),
        (2, [1, 0, 100]),
    ):
        begin = len(central.heard)
        for command in commands:
            await central.write(CHRONO, 0x0002, command)
        await asyncio.sleep(seconds)
        counts.append(collections.Counter(data[0] for _, _, data in central.heard[begin:]))
    await central.leave()
    return counts


def test_racechrono_finds_the_board_filters_and_decodes(on_air, on_the_road):
    plan, times = on_the_road
    (central,), record = on_air({**plan, "until": 30}, [(2.5, ask_racechrono, None)], "pico w", RECORD=True)
    silent, two, ended, all_ids = central.done.result()
    assert silent == {} and two.keys() == {1, 2} and sum(ended.values()) <= 2
    assert 178 <= two[1] <= 182 and 446 <= two[2] <= 453 and 18 <= all_ids[1] <= 21 and all_ids[1] == all_ids[2]
    values = {}
    for t_s in times[:2]:
        for sent_s, _, data in central.heard:
            values.update(channels(data) if sent_s <= t_s else {})
        assert abs(values["lean angle"] - record.lean_at(t_s)) <= 1
        assert 0 < values["its standard deviation"] < 3 and values["1 while the lean is trusted"] == 1
    assert -40 < values["yaw rate"] < -15 and 1.1 < values["vertical acceleration (specific force)"] < 1.5
    assert abs(values["roll rate"]) < 8 and abs(values["longitudinal acceleration"]) < 0.2
    assert record.ends == ["off"]


async def pair_and_listen(central):
    await central.connect(await central.find(CHRONO))
    await central.subscribe(CHRONO, 0x0001, "chrono")
    try:
        await central.connection.pair()
        await central.write(CHRONO, 0x0002, [1, 0, 100])
    finally:
        await asyncio.sleep(2)
        await central.leave()


def test_phone_must_enter_the_pin(on_air):
    """The Bluetooth stack enforces the PIN. A phone gets no packet with a wrong PIN."""
    visits = [(2, pair_and_listen, 314159), (10, pair_and_listen, 271828)]
    (wrong, right), _ = on_air({"lean": [[0, 25]], "until": 18}, visits, "esp32", LIVE_PIN=271828)
    assert wrong.done.exception() and not wrong.heard and right.done.exception() is None
    assert 15 <= len([data for _, _, data in right.heard if data[0] == 1]) <= 25
