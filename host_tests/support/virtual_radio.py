"""Connects the simulated board's radio, as a peripheral, to bumble's virtual radio, with a central on the other side.
Peripheral and central each have a whole Bluetooth LE stack. The stacks use the board's clock and run when its time
advances."""

import asyncio
import contextlib
from typing import Any

from bumble import att, core, hci, link, pairing
from bumble.controller import Controller
from bumble.device import Device, Peer
from bumble.gatt import Characteristic, CharacteristicValue, Service
from bumble.host import Host
from kickstand_sim.simulated_board import radio as model

PUMP_S = 0.005
ROUNDS = 12  # rounds of the event loop per call of pump(), because a packet passes several layers
ADDRESSES = "F0:00:00:00:00:01", "F1:00:00:00:00:02"
ASKED = {model.READ_PAIRED: "READ", model.WRITE_PAIRED: "WRITE"}


class BoardLoop(asyncio.SelectorEventLoop):
    """An event loop that runs on the board's clock."""

    def __init__(self, clock):
        self._board_clock = clock
        super().__init__()

    def time(self):
        return self._board_clock.now_us / 1e6

    def pump(self):
        """Run the tasks that are due, without waiting."""
        for _ in range(ROUNDS):
            self.call_soon(self.stop)
            self.run_forever()


@contextlib.contextmanager
def only_loop():
    """Hide playwright's idle event loop, if this process has used a browser."""
    browsers = asyncio._get_running_loop()
    asyncio._set_running_loop(None)
    try:
        yield
    finally:
        asyncio._set_running_loop(browsers)


def uuid_of(value):
    return core.UUID.from_16_bits(value) if isinstance(value, int) else core.UUID(value)


class _Pin(pairing.PairingDelegate):
    """Answers a request to pair. pin(): returns the PIN that is shown or typed on this side."""

    def __init__(self, pin, capability):
        super().__init__(capability)
        self._pin = pin

    async def generate_passkey(self):
        return self._pin()

    async def get_number(self):
        return self._pin()

    async def display_number(self, number, digits=6):
        pass


class Air:
    """Connects board.radio to the virtual radio."""

    def __init__(self, board):
        self.radio = board.radio
        self.loop = BoardLoop(board.clock)
        self._link = link.LocalLink()
        self._made = 0
        self._connection: Any = None
        self._characteristics = {}
        self.peripheral: Any = None
        self._advertised = None
        board.every(PUMP_S, self.pump)

    def pump(self):
        if self.radio.services and self.peripheral is None:
            self.peripheral = self._make("the board")
            self.loop.create_task(self._power_on())
        state = (self.radio.found, self.radio.named)
        if state != self._advertised and self.peripheral and self.peripheral.powered_on:
            self._advertised = state
            self.loop.create_task(self._advertise(*state))
        self.loop.pump()

    def close(self):
        self.loop.pump()
        for task in asyncio.all_tasks(self.loop):
            task.cancel()
        self.loop.pump()
        self.loop.close()

    def _make(self, name) -> Any:
        async def make():
            address = ADDRESSES[self._made % 2][:-1] + str(self._made)
            controller = Controller(name, link=self._link, public_address=hci.Address(address + "/P"))
            device = Device(name=name, address=hci.Address(address), host=Host(controller, controller))
            self._made += 1
            return device

        return self.loop.run_until_complete(make()) if not self.loop.is_running() else None

    def central(self, pin=None):
        """Return a central, a Device that can scan and connect. pin: the PIN that its rider types."""
        device = self._make("central")
        if pin is not None:
            delegate = _Pin(lambda: pin, pairing.PairingDelegate.KEYBOARD_INPUT_ONLY)
            device.pairing_config_factory = lambda _: pairing.PairingConfig(True, True, True, delegate)
        return device

    # The board's side

    async def _power_on(self):
        device = self.peripheral
        paired = bool(self.radio.config.get("mitm"))
        if paired:
            delegate = _Pin(self.radio.ask_pin, pairing.PairingDelegate.DISPLAY_OUTPUT_ONLY)
            device.pairing_config_factory = lambda _: pairing.PairingConfig(True, True, True, delegate)
        for service, characteristics in self.radio.services:
            characteristics_made = [self._characteristic(*definition) for definition in characteristics]
            device.add_service(Service(uuid_of(service), characteristics_made))
        device.on("connection", self._connected)
        await device.power_on()

    def _characteristic(self, kind, flags, handle):
        allowed = att.Attribute.Permissions.READABLE if flags & model.READ else att.Attribute.Permissions(0)
        allowed |= att.Attribute.Permissions.WRITEABLE if flags & model.WRITE else att.Attribute.Permissions(0)
        for bits, name in ASKED.items():
            if flags & bits:
                allowed |= att.Attribute.Permissions[f"{name}_REQUIRES_ENCRYPTION"]
                allowed |= att.Attribute.Permissions[f"{name}_REQUIRES_AUTHENTICATION"]

        def read(connection):
            return self.radio.values[handle]

        def write(connection, data):
            self.radio.paired = self.radio.paired or bool(connection.authenticated)
            self.radio.write(handle, data)

        characteristic = Characteristic(
            uuid_of(kind), Characteristic.Properties(flags & 0x1A), allowed, CharacteristicValue(read, write)
        )
        self._characteristics[handle] = characteristic
        return characteristic

    async def _advertise(self, found, named):
        if self._connection is None and found is not None:
            await self.peripheral.start_advertising(advertising_data=found, scan_response_data=named)
        elif self._connection is None:
            await self.peripheral.stop_advertising()

    def _connected(self, connection):
        self._connection = connection
        connection.on("disconnection", self._disconnected)
        self.radio.connect(self)

    def _disconnected(self, reason):
        self._connection = None
        if self.radio.phone is self:
            self.radio.disconnect()
        self._advertised = None

    # The radio's model calls these methods of a phone.

    def heard(self, handle, data):
        if self._connection:
            self.loop.create_task(
                self.peripheral.notify_subscriber(self._connection, self._characteristics[handle], data)
            )

    def dropped(self):
        if self._connection:
            self.loop.create_task(self._connection.disconnect())


class Central:
    """A phone on the virtual radio. heard: the received packets, [(s, name of the characteristic, bytes), ...]."""

    def __init__(self, air, pin=None):
        self.air = air
        self.device = air.central(pin)
        self.heard = []
        self.characteristics = {}
        self.connection: Any = None

    def at(self, at_s, visit):
        """Run the coroutine visit(self) from at_s on. The task `done` has its result or its exception."""

        async def run():
            await asyncio.sleep(max(0.0, at_s - self.air.loop.time()))
            await self.device.power_on()
            return await visit(self)

        self.done = self.air.loop.create_task(run())
        return self

    async def find(self, wanted, seconds=5.0):
        """Return the first Advertisement that names this service. Raises TimeoutError without one."""
        discovered = self.air.loop.create_future()

        def seen(advertisement):
            kinds = core.AdvertisingData
            listed = [
                core.UUID.from_bytes(data[offset : offset + size])
                for kind, size in (
                    (kinds.COMPLETE_LIST_OF_16_BIT_SERVICE_CLASS_UUIDS, 2),
                    (kinds.COMPLETE_LIST_OF_128_BIT_SERVICE_CLASS_UUIDS, 16),
                )
                for data in advertisement.data.get_all(kind, raw=True)
                for offset in range(0, len(data), size)
            ]
            if uuid_of(wanted) in listed and not discovered.done():
                discovered.set_result(advertisement)

        self.device.on("advertisement", seen)
        await self.device.start_scanning(active=True)
        try:
            return await asyncio.wait_for(discovered, seconds)
        finally:
            await self.device.stop_scanning()

    async def connect(self, advertisement):
        self.connection = await self.device.connect(advertisement.address, timeout=5.0)
        self.peer = Peer(self.connection)
        await self.peer.discover_services()
        for service in self.peer.services:
            for characteristic in await service.discover_characteristics():
                self.characteristics[str(service.uuid), str(characteristic.uuid)] = characteristic

    def place(self, service, kind):
        return self.characteristics[str(uuid_of(service)), str(uuid_of(kind))]

    async def subscribe(self, service, kind, name):
        def heard(data):
            self.heard.append((self.air.loop.time(), name, bytes(data)))

        await self.place(service, kind).subscribe(heard)

    async def write(self, service, kind, data, response=True):
        await self.place(service, kind).write_value(bytes(data), with_response=response)

    async def read(self, service, kind):
        return await self.place(service, kind).read_value()

    async def leave(self):
        with contextlib.suppress(core.BaseBumbleError, hci.HCI_Error):
            await self.connection.disconnect()
