"""The app's loop: its rate and its garbage collections."""

import contextlib
import gc
import itertools

import pytest
from kickstand_tools.simulated_board.fakes import fake_time
from kickstand_tools.simulated_board.simulator import Board
from support import device_runs
from support.board_access import level
from support.device_runs import FreshFirmware


def test_loop_has_100_turns_a_second_and_never_catches_up(with_app):
    def use(board, app):
        app.begin()
        for _ in range(100):  # until display and sensor are set up
            app.step()
        begin_us = board.clock.now_us
        for _ in range(50):
            app.step()
        lasted_us = board.clock.now_us - begin_us
        board.clock.at(board.clock.now_us, lambda: board.clock.advance(35_000))
        app.step()
        late_us = board.clock.now_us
        app.step()
        return lasted_us, board.clock.now_us - late_us

    lasted_us, after_us = with_app(use)
    assert lasted_us == pytest.approx(500_000, abs=1000) and after_us == pytest.approx(10_000, abs=1000)


@contextlib.contextmanager
def collections_at(now):
    """Append now() to the returned list at each complete garbage collection."""
    times = []

    def note(phase, info):
        if phase == "start" and info["generation"] == 2:
            times.append(now())

    gc.callbacks.append(note)
    try:
        yield times
    finally:
        gc.callbacks.remove(note)


@pytest.mark.parametrize(
    ("config", "fitted", "turns"),
    [
        ({}, {}, 40),
        ({}, {"display": "ssd1306"}, 23),
        ({"SPEED": "wheel"}, {}, 23),
        ({"user.py": True}, {}, 23),
        ({"LIVE": True}, {"machine": "pico w"}, 23),
    ],
    ids=["nothing else", "OLED", "speed source", "user.py", "phone"],
)
def test_garbage_is_collected_after_so_many_turns(config, fitted, turns, with_app, tmp_path):
    """Parts that use heap shorten the interval from the second collection on, if they are not there at the start."""
    if config.pop("user.py", False):
        (tmp_path / "user.py").write_text("")

    def use(board, app):
        if "LIVE" in config:
            from kickstand.live import live, radio

            live.attach(radio.Radio(None), app)
        gc.freeze()
        app.begin()
        numbers = [0]
        with collections_at(lambda: numbers[0]) as collections:
            for number in range(40 + 3 * turns):
                numbers[0] = number
                app.step()
        gc.unfreeze()
        return collections

    collections = with_app(use, config, **fitted)
    gaps = [later - earlier for earlier, later in itertools.pairwise(collections)]
    assert collections[0] in (turns - 1, 39) and gaps and set(gaps) == {turns}


@pytest.mark.parametrize(
    ("free", "could_grow", "turns"),
    [(500_000, 0, 40), (160_000, 0, 40), (156_000, 0, 39), (110_000, 70_000, 10), (75_000, 70_000, 3), (0, 0, 3)],
)
def test_small_heap_of_an_esp32_is_collected_earlier(free, could_grow, turns, monkeypatch):
    """A turn uses 2000 bytes, and half of the free heap is kept. The heap of an ESP32 can grow by the largest block of
    ESP-IDF's heap, which mem_free() counts too."""
    with FreshFirmware(), Board(level, machine="esp32"):
        import esp32  # pyright: ignore[reportMissingImports]
        from kickstand.board import port

        regions = [(90_000, 70_000, could_grow, 1000), (9000, 5000, could_grow // 2, 1000)]
        monkeypatch.setattr(esp32, "idf_heap_info", lambda kind: regions)
        monkeypatch.setattr(gc, "mem_free", lambda: free)
        assert port.turns_to_collect(40) == turns


@pytest.mark.parametrize(("chip", "processor_hz"), [("esp32", 240_000_000), ("pico", 160_000_000)])
def test_an_esp32_runs_at_240_mhz_and_yields(chip, processor_hz, monkeypatch):
    """Only sleep_ms() gives time to an ESP32's idle task and its radio. A Pico keeps its clock."""
    waits_ms, sleep_ms = [], fake_time.sleep_ms
    monkeypatch.setattr(fake_time, "sleep_ms", lambda ms: waits_ms.append(ms) or sleep_ms(ms))
    device = device_runs.Device(lambda t_s: (0.0, 1.0, 0.0, 0.0, 0.0, 0.0), machine=chip)
    device.run({}, [3.0])
    assert device.board.processor_hz == processor_hz
    assert sum(ms >= 5 for ms in waits_ms) > 100
