"""Reading a log needs memory for its numbers, and not for the text of its rows."""

import tracemalloc

from kickstand_tools.logs.reader import read_log
from support import command


def test_a_log_takes_at_most_250_bytes_per_sample(tmp_path):
    """A log has 13 columns of 8 bytes. While its blocks are joined, they are in memory twice."""
    count, path = 120_000, tmp_path / "RIDE.csv"
    rows = "".join(f"{k / 200:.3f},0.01{k % 997:03d},1.00321,-0.02345,1.23456,-2.34567,0.34567\n" for k in range(count))
    path.write_text(command.HEADER + "\n" + rows)
    tracemalloc.start()
    try:
        log = read_log(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(log.t_s) == count and peak / count < 250
