"""The whole device on a virtual radio. Board and phone both use bumble's Bluetooth LE stack. The central knows only
what the published documents say."""

import asyncio
import collections
import functools

import pytest
from support import device_plans
from support.device_runs import Device, world_of
from support.radio_decoder import SERVICE, channels

virtual_radio = pytest.importorskip("support.virtual_radio", reason="no bumble", exc_type=ImportError)

CHRONO = 0x1FF8
RATE, NOW, RIDE, BOARD = (SERVICE.replace("0000", f"000{number}", 1) for number in (2, 3, 4, 1))


@pytest.fixture
def on_air(tmp_path, monkeypatch, capsys):
    """Return run(until_s, [(at_s, visit, pin), ...], **config), which returns the Centrals and the device's Record."""
    monkeypatch.chdir(tmp_path)
    made = []
    browsers = asyncio._get_running_loop()  # playwright's idle event loop, if this process has used a browser
    asyncio._set_running_loop(None)

    def run(until_s, visits, machine="pico w", **config):
        world, _ = world_of(device_plans.ALIGNED)
        device = Device(world, machine=machine)
        for press in device_plans.PRESSES:
            device.board.press(*press)
        air = virtual_radio.Air(device.board)
        made.append(air)
        centrals = [virtual_radio.Central(air, pin).at(at_s, visit) for at_s, visit, pin in visits]
        device.run({"LIVE": True, **config}, [until_s])
        return centrals, device_plans.Record(device.record(), capsys.readouterr().out)

    yield run
    for air in made:
        air.close()
    asyncio._set_running_loop(browsers)


async def ask_racechrono(central):
    """Like the app: find, subscribe, deny all, allow two. Then allow all at once."""
    await central.connect(await central.find(CHRONO))
    await central.subscribe(CHRONO, 0x0001, "chrono")
    await central.write(CHRONO, 0x0002, [0])
    await asyncio.sleep(1)
    begun = len(central.heard)
    await central.write(CHRONO, 0x0002, [2, 0, 100, 0, 0, 0, 1])
    await central.write(CHRONO, 0x0002, [2, 0, 40, 0, 0, 0, 2])
    await asyncio.sleep(20)
    await central.leave()
    return begun


def test_racechrono_finds_the_board_filters_and_decodes(on_air):
    (central,), record = on_air(44, [(20, ask_racechrono, None)], RECORD=True)
    assert central.done.result() == 0  # the board sends nothing while the phone denies all packets
    counts = collections.Counter(data[0] for _, _, data in central.heard)
    assert counts.keys() == {1, 2} and 198 <= counts[1] <= 202 and 496 <= counts[2] <= 503
    for t_s in (device_plans.LEFT_S, device_plans.RIGHT_S):
        leans = [channels(data) for sent_s, _, data in central.heard if data[0] == 1 and sent_s <= t_s]
        assert abs(leans[-1]["lean angle"] - record.lean_at(t_s)) <= 1
    assert record.ends == ["off"]


async def press_in(central, pair=True):
    await central.connect(await central.find(CHRONO))
    await central.subscribe(CHRONO, 0x0001, "chrono")
    try:
        if pair:
            await central.connection.pair()
        await central.write(CHRONO, 0x0002, [1, 0, 100])
    finally:
        await asyncio.sleep(2)
        await central.leave()


just_write = functools.partial(press_in, pair=False)


def test_a_phone_must_enter_the_pin(on_air):
    """The Bluetooth stack enforces the PIN. A phone gets no packet without pairing, or with a wrong PIN."""
    visits = [(20, just_write, None), (26, press_in, 314159), (34, press_in, 271828)]
    (silent, wrong, right), _ = on_air(44, visits, machine="esp32", LIVE_PIN=271828)
    assert "INSUFFICIENT_" in str(silent.done.exception())
    assert wrong.done.exception() and not silent.heard and not wrong.heard
    assert right.done.exception() is None
    assert 15 <= len([data for _, _, data in right.heard if data[0] == 1]) <= 25
