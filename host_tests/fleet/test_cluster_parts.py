"""What happens to the tasks of a cluster, with Dask's client replaced: order, retries, time limits, lost workers."""

import threading
import time

import distributed
import pytest
from kickstand_fleet import cluster as module
from kickstand_fleet.cluster import CRASHED, TIMED_OUT, Cluster, run_tasks
from kickstand_tools.common.errors import InputError

ADDRESS = "tcp://a.cluster:8786"


class KilledWorker(Exception):
    """Dask's error for a task whose worker died."""


class Future:
    def __init__(self, client, key, item):
        self.client, self.key, self.item = client, key, item
        self.status, self.released = "pending", False

    def add_done_callback(self, ended):
        self.ended = ended
        self.client.begin(self)

    def end(self, status, error=None):
        self.status, self.error = status, error
        self.client.pending.remove(self)
        self.ended(self)

    def result(self):
        if self.error:
            raise self.error
        return self.item

    def exception(self):
        return self.error

    def cancel(self, force):
        self.client.cancelled.append((self.item, force))

    def release(self):
        self.released = True


class Client:
    """Replaces Dask's client.

    ways: {item: list of what its tasks do, in sequence}. Other tasks return their item.
    task_s: duration of a task.
    """

    ways: dict[int, list[str]] = {}
    task_s = 0.01
    latest: "Client"

    def __init__(self, address, timeout):
        Client.latest = self
        self.asked, self.status = (address, timeout), "running"
        self.workers = {"w1": {}, "w2": {}}
        self.pending, self.cancelled, self.restarted, self.most, self.begun = [], [], [], 0, []

    def wait_for_workers(self, count, timeout):
        self.waited = count, timeout

    def subscribe_topic(self, topic, note):
        self.note = note

    def scheduler_info(self, n_workers):
        return {"workers": self.workers}

    def submit(self, _announce, announced, _function, item, *, key, pure):
        assert announced == key and not pure
        return Future(self, key, item)

    def begin(self, future):
        self.pending.append(future)
        self.most = max(self.most, len(self.pending))
        self.begun.append(future.item)
        ways = self.ways.get(future.item, [])
        way = ways.pop(0) if ways else "return"
        if way == "hang":  # only a hanging task is announced, so no other task is ended on a busy machine
            self.note((time.time(), (future.key, "w1")))
            return
        errors = {"die": KilledWorker(), "raise": ValueError("on purpose"), "lose": OSError("gone")}
        status = {"die": "error", "raise": "error", "cancel": "cancelled", "disconnect": "cancelled"}.get(
            way, "finished"
        )
        if way == "disconnect":
            self.status = "closed"
        threading.Timer(self.task_s, future.end, (status, errors.get(way))).start()

    def restart_workers(self, workers, timeout, raise_for_error):
        self.restarted.append((workers, raise_for_error))

    def close(self, timeout):
        pass


@pytest.fixture(autouse=True)
def client(monkeypatch):
    monkeypatch.setattr(distributed, "Client", Client)
    monkeypatch.setattr(module, "_LOOK_S", 0.05)
    monkeypatch.setattr(Client, "ways", {})
    return Client


def outcomes(count, timeout_s=600.0, **ways):
    """Return {item: (result, reason, explanation)} of the tasks 0 to count - 1. ways: {"_2": [...]} for item 2."""
    Client.ways = {int(name[1:]): list(way) for name, way in ways.items()}
    found = list(run_tasks(lambda item: item, [(k,) for k in range(count)], ADDRESS, timeout_s=timeout_s))
    assert sorted(index for index, *_ in found) == list(range(count))  # each task has one outcome
    return {index: rest for index, *rest in found}


def test_each_task_has_one_outcome():
    assert outcomes(9) == {k: [k, "", ""] for k in range(9)}
    assert Client.latest.asked == (ADDRESS, 20.0) and Client.latest.waited == (1, 20.0)


@pytest.mark.parametrize(("workers", "most"), [(1, 2), (3, 6)])
def test_each_worker_has_two_tasks_at_a_time(monkeypatch, workers, most):
    monkeypatch.setattr(Client, "task_s", 0.4)  # all tasks are submitted before the first of them ends
    monkeypatch.setattr(Client, "scheduler_info", lambda *_, **__: {"workers": dict.fromkeys(range(workers))})
    outcomes(most + 1)
    assert Client.latest.most == most


def test_without_tasks_no_cluster_is_asked(monkeypatch):
    monkeypatch.setattr(distributed, "Client", None)
    assert list(run_tasks(print, [], ADDRESS)) == []


def test_an_error_of_a_task_is_its_outcome():
    found = outcomes(3, _1=["raise"])
    assert found[1] == [None, CRASHED, "ValueError: on purpose"] and found[2] == [2, "", ""]
    assert Client.latest.begun == [0, 1, 2]


@pytest.mark.parametrize("way", ["die", "cancel", "lose"])
def test_a_task_whose_worker_died_runs_again_alone_at_the_end(way):
    assert outcomes(6, _1=[way]) == {k: [k, "", ""] for k in range(6)}
    assert Client.latest.begun == [0, 1, 2, 3, 4, 5, 1]


@pytest.mark.parametrize("way", ["die", "cancel", "lose"])
def test_a_task_whose_worker_died_twice_is_the_cause(way):
    found = outcomes(6, _1=[way, way], _4=["die"])
    assert found[1][:2] == [None, CRASHED] and "died twice" in str(found[1][2])
    assert found[4] == [4, "", ""] and sorted(Client.latest.begun[6:]) == [1, 4]


def test_a_task_that_takes_too_long_is_ended_with_its_worker():
    found = outcomes(5, 0.3, _2=["hang"])
    assert found[2] == [None, TIMED_OUT, "took longer than 0 s, so it was ended"]
    assert {k: found[k] for k in (0, 1, 3, 4)} == {k: [k, "", ""] for k in (0, 1, 3, 4)}
    latest = Client.latest
    assert latest.cancelled == [(2, True)] and latest.restarted == [(["w1"], False)]


def test_a_lost_scheduler_ends_the_run():
    with pytest.raises(InputError, match=rf"the cluster at {ADDRESS} was lost; "):
        outcomes(3, _1=["disconnect"])


def test_a_run_ends_if_no_worker_comes_back(monkeypatch):
    monkeypatch.setattr(module, "_LOST_S", 0.3)
    Client.ways = {0: ["hang"]}
    with Cluster(ADDRESS, None, 600.0) as cluster:
        assert cluster.workers == 2
        Client.latest.workers = {}
        began_s = time.monotonic()
        with pytest.raises(InputError, match=rf"all workers at {ADDRESS} have ended; "):
            list(cluster.run(print, [(0,)]))
        assert 0.25 < time.monotonic() - began_s < 10.0


@pytest.mark.parametrize("error", [OSError("refused"), TimeoutError("none came"), ValueError("bad address")])
def test_a_cluster_that_cannot_be_reached_is_named(monkeypatch, error):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(distributed, "Client", fails)
    with pytest.raises(InputError, match=rf"no workers at {ADDRESS}: {error}"), Cluster(ADDRESS, None, 1.0):
        pass
    with pytest.raises(KeyError):
        monkeypatch.setattr(Client, "wait_for_workers", lambda *_, **__: {}["x"])
        monkeypatch.setattr(distributed, "Client", Client)
        Cluster(ADDRESS, None, 1.0).__enter__()
