"""What happens to the tasks of a cluster, with Dask's client replaced: retries, time limits, lost workers."""

import threading

import distributed
import pytest
from kickstand_fleet import cluster as module
from kickstand_fleet.cluster import CRASHED, TIMED_OUT, run_tasks
from kickstand_tools.common.errors import InputError

ADDRESS = "tcp://a.cluster:8786"


class KilledWorker(Exception):
    """Dask's error for a task whose worker died."""


class Future:
    def __init__(self, client, key, item):
        self.client, self.key, self.item, self.status = client, key, item, "pending"

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
        pass


ENDS = {
    "": ("finished", None),
    "lose": ("finished", OSError("the worker is gone")),
    "raise": ("error", ValueError("on purpose")),
    "die": ("error", KilledWorker("died")),
    "cancel": ("cancelled", None),
    "disconnect": ("lost", None),
}


class Client:
    """Replaces Dask's client. `set` gives it properties for one test.

    ways: {item: what its tasks do, in sequence}, a list of keys of ENDS, or "hang". Other tasks return their item.
    """

    latest: "Client"
    set: dict = {}

    def __init__(self, address, timeout):
        Client.latest = self
        self.asked, self.status, self.ways, self.task_s = (address, timeout), "running", {}, 0.01
        self.workers = {"w1": {}, "w2": {}}
        self.pending, self.cancelled, self.restarted, self.most, self.begun = [], [], [], 0, []
        self.__dict__.update(Client.set)
        if isinstance(address, str) and "error" in Client.set:
            raise Client.set["error"]

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
        self.note((0.0, (future.key, "w1")))
        ways = self.ways.get(future.item)
        way = ways.pop(0) if ways else ""
        if way == "vanish":
            self.workers = {}
        elif way == "disconnect":
            self.status = "closed"
        if way in ENDS:
            threading.Timer(self.task_s, future.end, ENDS[way]).start()

    def restart_workers(self, workers, timeout, raise_for_error):
        self.restarted.append((workers, raise_for_error))

    def close(self, timeout):
        pass


@pytest.fixture(autouse=True)
def client(monkeypatch):
    monkeypatch.setattr(distributed, "Client", Client)
    Client.set = {}


def outcomes(count, ways=None, timeout_s=600.0, **properties):
    """Return {item: [result, reason, explanation]} of the tasks 0 to count - 1."""
    Client.set = {"ways": {item: list(each) for item, each in (ways or {}).items()}} | properties
    results = list(run_tasks(lambda item: item, [(k,) for k in range(count)], ADDRESS, timeout_s=timeout_s))
    assert sorted(index for index, *_ in results) == list(range(count))  # each task has one outcome
    return {index: rest for index, *rest in results}


def test_each_task_has_one_outcome():
    assert outcomes(9) == {k: [k, "", ""] for k in range(9)}
    assert Client.latest.asked == (ADDRESS, 20.0) and Client.latest.waited == (1, 20.0)


@pytest.mark.parametrize(("workers", "most"), [(1, 2), (3, 6)])
def test_each_worker_has_two_tasks_at_a_time(workers, most):
    outcomes(most + 1, task_s=0.3, workers=dict.fromkeys(range(workers)))
    assert Client.latest.most == most


def test_without_tasks_no_cluster_is_asked():
    Client.set = {"error": OSError("refused")}
    assert list(run_tasks(print, [], ADDRESS)) == []


def test_an_error_of_a_task_is_its_outcome():
    results = outcomes(3, {1: ["raise"]})
    assert results[1] == [None, CRASHED, "ValueError: on purpose"] and results[2] == [2, "", ""]
    assert Client.latest.begun == [0, 1, 2]


@pytest.mark.parametrize("way", ["die", "cancel", "lose"])
def test_a_task_whose_worker_died_runs_again_alone_at_the_end(way):
    assert outcomes(6, {1: [way]}) == {k: [k, "", ""] for k in range(6)}
    assert Client.latest.begun == [0, 1, 2, 3, 4, 5, 1]


@pytest.mark.parametrize("way", ["die", "cancel", "lose"])
def test_a_task_whose_worker_died_twice_is_the_cause(way):
    results = outcomes(6, {1: [way, way], 4: ["die"]})
    assert results[1] == [None, CRASHED, "its worker died twice: out of memory, or a crash of a library"]
    assert results[4] == [4, "", ""] and sorted(Client.latest.begun[6:]) == [1, 4]


def test_a_task_that_takes_too_long_is_ended_with_its_worker():
    results = outcomes(5, {2: ["hang"]}, 0.3)
    assert results.pop(2) == [None, TIMED_OUT, "took longer than 0 s, so it was ended"]
    assert results == {k: [k, "", ""] for k in (0, 1, 3, 4)}
    assert Client.latest.cancelled == [(2, True)] and Client.latest.restarted == [(["w1"], False)]


def test_a_lost_scheduler_ends_the_run():
    with pytest.raises(InputError, match=rf"the cluster at {ADDRESS} was lost; finished work is kept"):
        outcomes(3, {1: ["disconnect"]})


def test_a_run_ends_if_no_worker_comes_back(monkeypatch):
    monkeypatch.setattr(module, "_LOST_S", 0.3)
    with pytest.raises(InputError, match=rf"all workers at {ADDRESS} have ended; finished work is kept"):
        outcomes(1, {0: ["vanish"]})


@pytest.mark.parametrize("error", [OSError("refused"), TimeoutError("none came"), ValueError("bad address")])
def test_a_cluster_that_cannot_be_reached_is_named(error):
    with pytest.raises(InputError, match=rf"no workers at {ADDRESS}: {error}"):
        outcomes(1, error=error)
    with pytest.raises(KeyError):  # a bug stays visible
        outcomes(1, error=KeyError("x"))
