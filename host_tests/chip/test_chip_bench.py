"""kickstand bench on the emulated Pico: its figures agree with each other and stay within their limits."""

import json

import pytest
from emulated import pico

pytestmark = pytest.mark.chip


@pytest.mark.long
@pytest.mark.parametrize("modes", [{}, pytest.param({"recording": {"RECORD": True}}, marks=pytest.mark.nightly)])
def test_bench(monkeypatch, modes):
    """A short run: stages add up, nothing is lost, the heap does not shrink."""
    pico()  # or skip
    from kickstand_workshop.bench import bench

    monkeypatch.setattr(bench, "_MODES", modes)
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
    assert 0.1 < result["cpu_share"] < 0.5
    assert result["free_heap_bytes"] > 120_000
    assert result["free_heap_at_end_bytes"] > result["free_heap_bytes"] - 4000
    boots = result["boot"]
    assert boots["mpy"]["lean_s"] < 0.95
    assert boots["mpy"]["lean_s"] < boots["py"]["lean_s"] < 5.0
    assert 0 < boots["mpy"]["micropython_s"] < 0.1
    assert 0.2 < boots["mpy"]["starting_s"] < boots["mpy"]["sampling_s"] < boots["mpy"]["lean_s"]
    assert 0.4 < sum(boots["mpy"]["import_s"].values()) < boots["mpy"]["sampling_s"]
    assert "kickstand.lean.lean_filter" in boots["mpy"]["import_s"]
    assert result["flash_bytes"]["mpy"] < result["flash_bytes"]["py"] / 2
    assert bench.tables(result)
