"""Runs a function on many items with Dask, on this computer or on a cluster.

Workers on this computer and their scheduler communicate over 127.0.0.1 with TLS. Each run creates its own keys, and
only the processes of the run have them. Another user of the computer can connect, but can neither read nor run
anything. Unix sockets would exclude other users, but Dask does not support them. Dask's web pages are off. Without
Dask, a process pool would need its own crash handling.

A task that kills its worker must not harm other tasks. By default Dask retries such a task on other workers. A task
that kills its worker would kill the other workers too, and Dask would recompute their finished results. For this reason
the module forbids retries, submits only a few tasks at a time, and lets Dask keep no results. A task whose worker died
runs a second time, alone, after all other tasks. If a worker dies again, the task is the cause.
"""

import contextlib
import logging
import queue
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import resource_tracker
from typing import Any

from kickstand_tools.common.messages import InputError, cause

from . import KEPT

CRASHED, TIMED_OUT = "crashed", "timed-out"
_PER_WORKER = 2  # tasks submitted per worker: one runs, the other waits
_LOOK_S = 0.5  # time between two checks for tasks that take too long
_TOPIC = "kickstand-fleet"  # topic of the messages by which a worker announces that it begins a task
Outcome = tuple[int, Any | None, str, str]
_LOCAL_PATIENCE_S, _REMOTE_PATIENCE_S = 60.0, 20.0  # longest time to wait for the first worker
# Longest wait for the restart of a worker. A restart after this time would end the worker's next task, too
_RESTART_S = 120.0
# Longest time without a worker. Dask replaces a dead worker sooner: on a very busy computer after a minute or more.
_LOST_S = 180.0

_DASK_SETTINGS = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.comm.timeouts.connect": "10s",
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}


def run_tasks(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    scheduler: str | None = None,
    workers: int | None = None,
    timeout_s: float = 600.0,
) -> Iterator[Outcome]:
    """Run function(*item) for each item, and yield one outcome per item, in any order.

    The arguments scheduler, workers and timeout_s have the same meaning as for Cluster. Starts no workers if there are
    no items.

    Yields:
        index: index of the item.
        result: the function's result, None if it did not return.
        reason: CRASHED or TIMED_OUT, "" if there is a result.
        explanation: the reason in words, "" if there is a result.
    """
    if items:
        with Cluster(scheduler, workers, timeout_s) as cluster:
            yield from cluster.run(function, items)


class Cluster:
    """A connection to Dask's workers, used as a context: `with Cluster(scheduler, workers, timeout_s) as cluster`.

    Args:
        scheduler: Address of a scheduler. None starts workers on this computer.
        workers: Number of workers on this computer. None starts one per processor.
        timeout_s: Longest time for one task. A task that takes longer is ended.

    The attribute `workers` holds the actual number of workers after the connection. Entering the context raises
    InputError if no workers can be reached.
    """

    def __init__(self, scheduler: str | None, workers: int | None, timeout_s: float) -> None:
        self._address, self._wanted, self._timeout_s = scheduler, workers, timeout_s
        self.workers = 0

    def __enter__(self) -> "Cluster":
        """Connect to the workers. Raises InputError without a worker."""
        import distributed  # noqa: F401 - adds its settings to config; imported here, because Dask is slow to import
        from dask import config

        _silence()
        self._stack = contextlib.ExitStack()
        # Turn the log messages of workers off from their start, as _silence() does in this process
        environ = config.get("distributed.nanny.pre-spawn-environ") | {"DASK_LOGGING__DISTRIBUTED": "critical"}
        self._stack.enter_context(config.set({**_DASK_SETTINGS, "distributed.nanny.pre-spawn-environ": environ}))
        try:
            self._client = self._connect()
            patience_s = _LOCAL_PATIENCE_S if self._address is None else _REMOTE_PATIENCE_S
            self._client.wait_for_workers(1, timeout=patience_s)
        except BaseException as error:  # including Ctrl-C
            self.__exit__()
            if not isinstance(error, (OSError, TimeoutError, ValueError)):
                raise
            address = self._address or "this computer"
            raise InputError(f"no workers at {address}: {cause(error)}") from error
        # The time when each task began and the address of its worker, by the key of the task
        self._started: dict[str, tuple[float, str]] = {}
        self._client.subscribe_topic(_TOPIC, self._note_begin)
        self.workers = len(self._client.scheduler_info(n_workers=-1)["workers"])
        return self

    def _connect(self) -> Any:
        """Return a client of the scheduler, which is started first if it has no address. The stack closes both."""
        from distributed import Client, LocalCluster, WorkerPlugin
        from distributed.security import Security

        class Undisturbed(WorkerPlugin):
            """Makes workers ignore Ctrl-C in a terminal. The main process ends them."""

            def setup(self, worker: Any) -> None:
                signal.signal(signal.SIGINT, signal.SIG_IGN)

        if self._address is not None:
            client = Client(self._address, timeout=_REMOTE_PATIENCE_S)
            self._stack.callback(client.close, timeout=2)
            return client
        keys = Security.temporary()
        with _without_interrupts():
            cluster = LocalCluster(
                n_workers=self._wanted,
                threads_per_worker=1,
                host="127.0.0.1",
                security=keys,
                dashboard_address="127.0.0.1:0",
            )
            self._stack.callback(cluster.close, timeout=5)
            client = Client(cluster)
            self._stack.callback(client.close, timeout=2)
            client.register_plugin(Undisturbed())
        return client

    def __exit__(self, *exception: object) -> None:
        with contextlib.suppress(Exception):
            self._stack.close()

    def run(self, function: Callable[..., Any], items: Sequence[tuple[Any, ...]]) -> Iterator[Outcome]:
        """Yield the outcomes of run_tasks(). The function and the items must be picklable.

        Raises InputError if the connection to the scheduler is lost, or if no worker is left.
        """
        self._ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._under_way: dict[str, tuple[int, Any]] = {}
        self._working_s = time.monotonic()  # latest time at which a task ended or a worker existed
        suspects: list[int] = []
        waiting = deque(range(len(items)))
        while waiting or self._under_way:
            while waiting and len(self._under_way) < _PER_WORKER * max(1, self.workers):
                self._submit(function, items, waiting.popleft())
            yield from self._collect(suspects)
        for index in suspects:
            self._submit(function, items, index)
            crashed: list[int] = []
            while self._under_way:
                yield from self._collect(crashed)
            if crashed:
                yield index, None, CRASHED, "its worker died twice: out of memory, or a crash of a library"

    def _submit(self, function: Callable[..., Any], items: Sequence[tuple[Any, ...]], index: int) -> None:
        key = f"fleet-{index}-{time.monotonic_ns()}"
        future = self._client.submit(_announce_and_run, key, function, *items[index], key=key, pure=False)
        self._under_way[key] = index, future
        future.add_done_callback(self._ended.put)

    def _collect(self, suspects: list[int]) -> Iterator[Outcome]:
        """Yield the outcome of a task that ends within _LOOK_S, and the outcomes of overdue tasks.

        suspects: the index of each task whose worker died is appended.
        """
        try:
            future = self._ended.get(timeout=_LOOK_S)
        except queue.Empty:
            self._check_workers()
        else:
            self._working_s = time.monotonic()
            index, _ = self._under_way.pop(future.key, (None, None))
            self._started.pop(future.key, None)
            if index is None:  # an overdue task, whose outcome is known
                return
            outcome = self._outcome(index, future)
            if outcome is None:
                suspects.append(index)
            else:
                yield outcome
            future.release()
        yield from self._end_overdue_tasks()

    def _outcome(self, index: int, future: Any) -> Outcome | None:
        """Return the outcome of a task that has ended; None if its worker died. Raises InputError without a cluster."""
        if future.status == "finished":
            try:
                return index, future.result(), "", ""
            except Exception:  # the worker of the task died before the result was fetched
                return None
        if future.status == "error":
            error = future.exception()
            killed = type(error).__name__ == "KilledWorker"
            return None if killed else (index, None, CRASHED, f"{type(error).__name__}: {error}")
        if self._client.status == "running":
            return None  # the worker was ended because of another task
        raise InputError(f"the cluster{self._where()} was lost; {KEPT}")

    def _check_workers(self) -> None:
        """Raise InputError if no worker has existed for _LOST_S. Without a worker the tasks would wait for ever."""
        now_s = time.monotonic()
        if self._client.scheduler_info(n_workers=1)["workers"]:
            self._working_s = now_s
        elif now_s - self._working_s > _LOST_S:
            raise InputError(f"all workers{self._where()} have ended; {KEPT}")

    def _where(self) -> str:
        return f" at {self._address}" if self._address else ""

    def _end_overdue_tasks(self) -> Iterator[Outcome]:
        now_s = time.monotonic()
        for key, (began_s, worker) in list(self._started.items()):
            if key not in self._under_way:
                self._started.pop(key, None)
            elif now_s - began_s > self._timeout_s:
                index, future = self._under_way.pop(key)
                self._started.pop(key, None)
                future.cancel(force=True)
                with contextlib.suppress(Exception):  # the worker may already be dead
                    self._client.restart_workers([worker], timeout=_RESTART_S, raise_for_error=False)
                yield index, None, TIMED_OUT, f"took longer than {self._timeout_s:.0f} s, so it was ended"

    def _note_begin(self, event: tuple[float, Any]) -> None:
        _, (key, worker) = event
        self._started[key] = time.monotonic(), worker


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """A context that defers Ctrl-C to its end, because Dask would print pages of errors.

    Processes that are started in the context never receive Ctrl-C.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    # Start Python's resource tracker now. If Python started the tracker with the first process, the tracker would
    # unblock Ctrl-C
    resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _silence() -> None:
    """Turn Dask's log messages off. Outcomes and InputErrors report the failures of workers and scheduler instead."""
    for name in ("distributed", *logging.root.manager.loggerDict):
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _announce_and_run(key: str, function: Callable[..., Any], *arguments: Any) -> Any:
    from distributed import get_worker

    worker = get_worker()
    worker.log_event(_TOPIC, (key, worker.address))
    return function(*arguments)
