"""A simulated board on the virtual radio, for a page with a fake navigator.bluetooth. The board runs in a thread, in
real time."""

import asyncio
import base64
import contextlib
import os
import queue
import threading
from concurrent.futures import Future
from pathlib import Path

from support import virtual_radio
from support.device_runs import Device, world_of
from support.radio_decoder import SERVICE

FAKE = Path(__file__).with_name("fake_bluetooth.js").read_text()


class Bridge:
    """Runs a simulated board in a thread.

    plan: see run_device() in device_runs.py.
    begin_s: the board's time from which on it runs in real time. Before begin_s it runs as fast as possible.
    """

    def __init__(self, plan, begin_s, directory):
        self._requests = queue.Queue()
        self._packets = []
        self._lost = False
        self._over = False
        self.ready = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(plan, begin_s, directory), daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._over = True
        self._thread.join(20)

    def _run(self, plan, begin_s, directory):
        previous = os.getcwd()
        os.chdir(directory)
        world, _ = world_of(plan)
        device = self.device = Device(world, machine="pico w")
        for press in plan["presses"]:
            device.board.press(*press)
        air = self.air = virtual_radio.Air(device.board)
        self.central = virtual_radio.Central(air).at(begin_s - 1, self._serve)
        device.board.at(begin_s, lambda: device.board.clock.set_pace(1.0))
        device.board.every(0.2, self._look_whether_over)
        with contextlib.suppress(SystemExit):
            device.run(plan["config"], [plan["until"]])
        air.close()
        os.chdir(previous)

    def _look_whether_over(self):
        if self._over:
            raise SystemExit

    async def _serve(self, central):
        self.ready.set()
        while True:
            await asyncio.sleep(0.01)
            with contextlib.suppress(queue.Empty):
                name, kind, data, answer = self._requests.get_nowait()
                try:
                    answer.set_result(await getattr(self, "_" + name)(central, kind, data))
                except (Exception, asyncio.CancelledError) as error:
                    # If a connection is lost, bumble cancels the calls that wait for it. The page must get the error
                    # and continue.
                    task = asyncio.current_task()
                    if task is not None and task.cancelling():
                        raise
                    answer.set_exception(RuntimeError(f"{name}: {type(error).__name__} {error}"))

    async def _connect(self, central, kind, data):
        await central.connect(await central.find(SERVICE, 3))
        central.connection.on("disconnection", self._gone)
        self._lost = False

    def _gone(self, reason):
        self._lost = True

    async def _disconnect(self, central, kind, data):
        await central.leave()

    async def _read(self, central, kind, data):
        return base64.b64encode(bytes(await central.read(SERVICE, kind))).decode()

    async def _write(self, central, kind, data):
        await central.write(SERVICE, kind, base64.b64decode(data))

    async def _subscribe(self, central, kind, data):
        def heard(value):
            self._packets.append([kind, base64.b64encode(bytes(value)).decode()])

        await central.place(SERVICE, kind).subscribe(heard)

    # Called by the page.

    def do(self, name, kind, data):
        answer = Future()
        self._requests.put((name, kind, data, answer))
        return answer.result(120)

    def heard(self):
        packets, self._packets = self._packets, []
        return {"lost": self._lost, "packets": packets}

    def ms(self):
        """Return the board's time in ms."""
        return self.device.board.clock.now_us // 1000

    # The next methods are called by a test.

    def drop(self):
        """Cut the connection."""
        self.device.board.clock.at(0, self.air.dropped)

    def silence(self, on):
        """Move the board out of reach, and back."""
        self.air.radio.away = on
