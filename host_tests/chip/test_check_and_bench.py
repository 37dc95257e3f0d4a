"""`kickstand check` and `kickstand bench` on the emulated boards: each planted defect is named, and the loop, the start
and the heap stay within their limits."""

import pytest
from kickstand_tools.deploy import check
from support.checked_board import part
from support.emulated import CHIPS, modules, pico

pytestmark = [pytest.mark.chip, pytest.mark.long]
REST = part(4, share=0.3)


def checked(chip, world=REST, plant=None, press=True, files=None, **fitted):
    """Run `kickstand check` on an emulated board. Return the bad findings as {what was checked: line}."""
    with CHIPS[chip](world, modules(chip) | (files or {}), **fitted) as device:
        if plant:
            plant(device.board)

        def say(text):
            if press and text.startswith("Press"):
                device.board.press(device.time_s + 0.5, 0.2)

        def ask(code):
            try:
                return device.exec(code, 150)
            except Exception as error:
                raise check.GuestFailed(str(error).strip().rpartition("\n")[2]) from error

        findings = check.measured(ask, say)
    return {finding.what: finding.line for finding in findings if finding.verdict != check.GOOD}


@pytest.mark.parametrize("chip", ["pico"])
def test_a_good_board_is_good(chip):
    assert checked(chip) == {}


def spoilt(t_s):
    """Return the readings of a sensor with many defects. The accelerometer's x is dead and its y is noisy. The gyro's x
    is biased, its y is noisy and its z is dead. The chip is hot."""
    force, rate = list(REST(t_s)[:3]), list(REST(t_s)[3:6])
    hashed = int(t_s * 1e4) * 2654435761 % 65536 / 65536 - 0.5
    force[0] = 0.3
    force[1] += 0.1 * hashed
    return (*force, rate[0] + 45, rate[1] + hashed, 0.5, 70.0)


def many(board):
    board.sensor.self_test = [1, 1, 0.7, 1.3, 1, 1]
    board.sensor.clock_error = 0.05
    board.remove_lcd()


@pytest.mark.parametrize("chip", ["pico"])
def test_defects_of_many_parts_are_found_at_once(chip):
    bad = checked(chip, spoilt, many, press=False)
    expected = {"noise, accelerometer x", "noise, accelerometer y", "noise, gyro y", "noise, gyro z", "bias, gyro x"}
    expected |= {"temperature", "self-test, accelerometer z", "self-test, gyro x", "sample clock", "display", "button"}
    assert expected <= set(bad), bad
    possible = {"self-test, accelerometer x", "self-test, gyro z", "sensor while running", "bias, accelerometer"}
    assert set(bad) - expected <= possible | {"noise, gyro x"}, bad


def test_the_loop_and_the_start_stay_within_their_limits():
    """No sample is lost, the heap does not shrink, and the first lean appears within a second."""
    pico()  # skips the test without the emulator
    from kickstand_emulator import bench

    result = bench.loop(2)  # within only one second the number of garbage collections varies
    for spread in result["turn_us"], result["collection_pause_us"]:
        assert 0 < spread["median"] <= spread["p99"] <= spread["max"]
    assert result["samples_taken"] == pytest.approx(result["seconds"] * bench.SAMPLE_HZ, abs=2)
    assert result["samples_lost"] == 0
    assert 0.1 < result["cpu_share"] < 0.46
    assert result["free_heap_bytes"] > 138_000
    assert result["free_heap_at_end_bytes"] > result["free_heap_bytes"] - 4000
    start = bench.start("rp2040")
    assert 0 < start.micropython_s < 0.1
    assert 0.2 < start.starting_s <= start.sampling_s < start.lean_s < 1.0


@pytest.mark.parametrize(
    ("chosen", "free_kb"),
    [
        ({}, 141.8),
        ({"SPEED": "wheel"}, 106.0),
        ({"RECORD": True}, 120.8),
        ({"DISPLAY": "ssd1306"}, 130.1),
        ({"LIVE": True}, 131.8),
    ],
)
def test_free_heap_and_names_of_each_mode(chosen, free_kb):
    """The 1,261st name takes 8 KB in one piece, for which a board that runs has no room."""
    pico()  # skips the test without the emulator
    from kickstand_emulator import bench

    result = bench.loop(1, chosen=chosen)
    assert result["free_heap_bytes"] / 1024 == pytest.approx(free_kb, abs=2.0)
    assert result["names"] < 1260
