"""The command `kickstand bench` on the emulated Pico: its figures agree with each other and are within their limits."""

import json

import pytest
from support.emulated import pico

pytestmark = [pytest.mark.chip, pytest.mark.nightly, pytest.mark.long]


def test_the_loop_and_the_start_stay_within_their_limits():
    """No sample is lost, the heap does not shrink, and the first lean appears within 1.12 s."""
    pico()  # skips the test without the emulator
    from kickstand_workshop.bench import bench

    result = bench.loop(2)  # within only one second the number of garbage collections varies
    for spread in result["turn_us"], result["collection_pause_us"]:
        assert 0 < spread["median"] <= spread["p99"] <= spread["max"]
    assert result["samples_taken"] == pytest.approx(result["seconds"] * bench.SAMPLE_HZ, abs=2)
    assert result["samples_lost"] == 0
    assert 0.1 < result["cpu_share"] < 0.50
    assert result["free_heap_bytes"] > 120_000
    assert result["free_heap_at_end_bytes"] > result["free_heap_bytes"] - 4000
    start = bench.start("rp2040")
    assert 0 < start.micropython_s < 0.1
    assert 0.2 < start.starting_s < start.sampling_s < start.lean_s < 1.12
    assert 0.4 < sum(start.import_s.values()) < start.sampling_s
    assert "kickstand.lean.lean_filter" in start.import_s


def test_bench(monkeypatch):
    """In a short run of all parts, the times of the stages add up, and each figure is in the tables."""
    pico()  # skips the test without the emulator
    from kickstand_workshop.bench import bench

    monkeypatch.setattr(bench, "_MODES", {"recording": {"RECORD": True}})
    result = json.loads(json.dumps(bench.bench(1)))
    stages = {name: spread["median"] for name, spread in result["stage_us"].items()}
    parts = ("read", "decode and sum", "check", "calibrate and rotate", "filter", "rest of the meter")
    assert all(stages[name] > 0 for name in parts)
    assert sum(stages[name] for name in parts) == pytest.approx(stages["sample path"], rel=0.1)
    assert 390 < stages["read"]
    assert all(0 < us["median"] <= us["p99"] <= us["max"] for us in result["stage_us"].values())
    assert result["boot"]["mpy"]["lean_s"] < result["boot"]["py"]["lean_s"] < 5.0
    assert result["flash_bytes"]["mpy"] < result["flash_bytes"]["py"] / 2
    assert bench.tables(result)
