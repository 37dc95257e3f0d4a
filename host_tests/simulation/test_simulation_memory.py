"""A long ride fits into memory: an hour has 3.6 million rows at the chip's 1 kHz."""

import tracemalloc

import pytest
from kickstand_tools.simulation.physics import chip
from kickstand_tools.simulation.ride import ride

SECONDS = 400.0
COLUMN = SECONDS * chip.RATE_HZ * 8  # bytes of one number a row


@pytest.mark.parametrize("profile", ["street", "creep"])
def test_a_ride_takes_at_most_so_many_columns(profile):
    """And what it gives back keeps nothing at 1 kHz alive."""
    tracemalloc.start()
    try:
        made = ride(profile, seed=0, seconds=SECONDS)
        left, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert made.rate_hz == 200.0
    assert peak < 44 * COLUMN
    assert left < 6 * COLUMN
