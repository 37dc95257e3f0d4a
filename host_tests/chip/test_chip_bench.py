"""kickstand bench on the emulated Pico: its figures agree with each other and stay within their limits."""

import json

import pytest
from emulated import pico

pytestmark = pytest.mark.chip


def test_bench():
    """A short run: stages add up, nothing is lost, the heap does not shrink."""
    pico()  # or skip
    from kickstand_tools.bench import bench

    result = json.loads(json.dumps(bench.bench(1)))
    stages = {name: spread["median"] for name, spread in result["stage_us"].items()}
    parts = ("read", "decode and sum", "check", "calibrate and rotate", "filter", "rest of the meter")
    assert all(stages[name] > 0 for name in parts)
    assert sum(stages[name] for name in parts) == pytest.approx(stages["sample path"], rel=0.1)
    assert 390 < stages["read"]
    for spread in (*result["stage_us"].values(), result["turn_us"], result["collection_pause_us"]):
        assert 0 < spread["median"] <= spread["p99"] <= spread["max"]
    assert result["samples_taken"] == pytest.approx(result["seconds"] * result["sample_hz"], abs=2)
    assert result["samples_lost"] == 0
    assert 0.1 < result["cpu_share"] < 1.0
    assert result["free_heap_bytes"] > 120_000
    assert result["free_heap_at_end_bytes"] > result["free_heap_bytes"] - 4000
    assert result["first_lean_s"]["mpy"] < result["first_lean_s"]["py"] < 5.0
    assert result["flash_bytes"]["mpy"] < result["flash_bytes"]["py"] / 2
    assert bench.tables(result)
