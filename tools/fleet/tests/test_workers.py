"""Dask's real workers: a fleet on this computer, tasks that kill their workers, other users, and Ctrl-C."""

import contextlib
import signal
import socket
import ssl
import subprocess
import sys
from collections import Counter

import pytest
from fleet_tasks import task
from kickstand_fleet.cluster import CRASHED, run_tasks
from support import command


def test_a_fleet_runs_on_workers_of_this_computer(fleet, periods, results, tmp_path):
    from pyarrow import parquet

    (fleet.directory / "TWO.csv").write_text(
        "vehicle,path,kind\n"
        + "".join(f"{period.vehicle},{path},{period.kind}\n" for period in periods[:2] for path in period.paths)
    )
    result = command.works("fleet", fleet.directory / "TWO.csv", "--out", tmp_path, "--workers", 1)
    assert "mounted sensors: 2\naligned: 2, refused: 0, errors: 0\n" in result.out
    for row in parquet.read_table(tmp_path / "alignments.parquet").to_pylist():
        assert row["vehicle_from_sensor"] == results[row["vehicle"]].alignment["vehicle_from_sensor"]


@pytest.mark.long
def test_bad_tasks_cost_no_other_task(tmp_path):
    """One task kills its workers, and one raises an error."""
    note = tmp_path / "began"
    behaviours = {2: "die", 4: "raise"}
    items = [(k, behaviours.get(k, ""), str(note)) for k in range(10)]
    results = {index: (result, reason) for index, result, reason, _ in run_tasks(task, items, None, 2)}
    assert results == {k: (k, "") for k in range(10)} | {2: (None, CRASHED), 4: (None, CRASHED)}
    starts = Counter(int(line.split()[0]) for line in note.read_text().splitlines())
    assert starts[2] == 2 and sum(starts.values()) <= 10 + 6  # finished tasks are not computed again


PROGRAM = """
import signal, sys
from kickstand_fleet.cluster import Cluster
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # programs in the background of a shell ignore Ctrl-C
    with Cluster(None, 1, 60.0) as cluster:
        print("running", flush=True)
        sys.stdin.read()
"""
# Ctrl-C comes while Dask connects
CONNECTING = """
import os, signal, threading
from distributed import Client
register = Client.register_plugin
def interrupted(client, plugin):
    threading.Timer(0.02, os.kill, (os.getpid(), signal.SIGINT)).start()
    return register(client, plugin)
Client.register_plugin = interrupted
"""


def answer(port, secret):
    """Return the bytes that another user of the computer gets from a port: "" if it refuses."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=3.0) as plain:
        with context.wrap_socket(plain) if secret else plain as connection:
            connection.sendall(b"GET /json/identity.json HTTP/1.0\r\n\r\n")
            return connection.recv(1000)
    return b""


@pytest.mark.long
def test_other_users_can_neither_read_nor_run_anything(tmp_path):
    """All sockets are on 127.0.0.1, and accept only the keys of the run."""
    import psutil

    (tmp_path / "program.py").write_text(PROGRAM)
    piped = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen([sys.executable, str(tmp_path / "program.py")], **piped) as process:
        assert process.stdout is not None and process.stdin is not None and process.stderr is not None
        assert process.stdout.readline() == b"running\n"
        family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
        addresses = [
            open.laddr for member in family for open in member.net_connections("inet") if open.status == "LISTEN"
        ]
        assert len(addresses) >= 3 and {address.ip for address in addresses} == {"127.0.0.1"}
        for port in {address.port for address in addresses}:
            for secret in (False, True):
                reply = answer(port, secret)
                assert not reply or b"404" in reply, reply
        process.stdin.close()
        assert process.stderr.read() == b""  # Dask would print each connection that it refuses


@pytest.mark.long
@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Ctrl-C comes at once on this system")
def test_ctrl_c_while_connecting_is_deferred(tmp_path):
    (tmp_path / "program.py").write_text(CONNECTING + PROGRAM)
    ended = subprocess.run(
        [sys.executable, str(tmp_path / "program.py")], capture_output=True, text=True, timeout=120, input=""
    )
    assert ended.stderr.count("Traceback") == 1 and ended.stderr.endswith("KeyboardInterrupt\n")
