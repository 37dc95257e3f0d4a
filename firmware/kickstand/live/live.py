"""Sends the meter's results from the loop to a phone, at the rate that the phone requests."""

from array import array
from math import degrees, sqrt
from time import ticks_add, ticks_diff, ticks_ms

from ..units import const
from . import radio as packets
from .radio import LEAN, MOTION, OWN, SPEED

_LOOK_MS = const(1000)
# Time after which a phone that requests nothing is disconnected, so that the next phone can connect. Typing a PIN takes
# up to half of this time.
_IDLE_S = const(60)
_SAMPLES = 8  # largest number of samples that Transform takes


class Live:
    """Sends packets to one phone.

    Args:
        radio: a Radio.
        app: the App, whose lean, meter, drive, rides and clock are read.

    Attributes:
        asked: the kind of packets that the phone has requested, "RaceChrono" or "browser", or None.
        per_second: number of packets sent in the last second.
        period_ms: shortest interval between packets that the phone has requested, or 0 without a request.
    """

    def __init__(self, radio, app):
        self.radio = radio
        self._app = app
        self._intervals = [0] * 4
        self._dues = [ticks_ms()] * 4
        self._sums, self._n = [0] * 7, 0
        self._scaled = array("i", [0] * 7)
        self._force, self._rate = [0.0] * 3, [0.0] * 3
        self._buffer = bytearray(20)
        self._views = {size: memoryview(self._buffer)[:size] for size in (6, 7, 14, 15, 20)}
        self._look_ms = self._due_ms = 0
        self._begin()

    def _begin(self):
        """Handle a new phone, or the loss of the phone."""
        self.radio.changed = False
        self.asked = None
        self.per_second = self._sent = self._idle_s = 0
        self._advertised = False
        self._intervals[:] = (0,) * 4
        self._ask()

    def _ask(self):
        """Restart the means, because the phone has requested other packets. A mean must not include a time before the
        request."""
        self._due_ms = ticks_ms()
        for i in range(4):
            self._dues[i] = self._due_ms
        self.period_ms = min([ms for ms in self._intervals if ms] or [0])
        self._clear()

    def _clear(self):
        self._n = 0
        for i in range(7):
            self._sums[i] = 0

    def feed(self, sums, n):
        """Take the samples of a pass of the loop. Call this method once per pass with samples while period_ms is not 0.

        Args:
            sums: sums of the samples' counts, 7 values.
            n: number of samples.
        """
        total = self._sums
        for i in range(7):
            total[i] += sums[i]
        self._n += n

    def poll(self, now_ms):
        """Send the packets whose time has come. Call this method once per pass of the loop. Never waits."""
        radio = self.radio
        if radio.changed:
            self._begin()
            if not radio.written:  # forget what the last phone has written
                radio.take_writes(radio.filter)
                radio.take_writes(radio.rate)
            self._look_ms = now_ms
        if radio.written:
            self._hear()
        if self.period_ms and ticks_diff(now_ms, self._due_ms) >= 0:
            self._send(now_ms)
        if ticks_diff(now_ms, self._look_ms) >= 0:
            self._look(now_ms)

    def _hear(self):
        radio = self.radio
        radio.written = False
        data = radio.take_writes(radio.filter)
        while data:
            length = packets.FILTER_LENGTHS.get(data[0], len(data))
            if packets.take_filter(data[:length], self._intervals):
                self.asked = "RaceChrono"
            data = data[length:]
        data = radio.take_writes(radio.rate)
        if len(data) % 2 == 0 and packets.take_rate(data[-2:], self._intervals):  # the last of several commands
            self.asked = "browser"
        self._ask()

    def _look(self, now_ms):
        """Do the work of each second: advertise, send the ride's packet, and disconnect an idle phone."""
        self._look_ms = ticks_add(now_ms, _LOOK_MS)
        self.per_second, self._sent = self._sent, 0
        radio, app = self.radio, self._app
        if radio.phone is None:
            self._advertised = self._advertised or radio.advertise()
            return
        size = packets.pack_ride(self._buffer, self._state(self._app.lean_deg), app.meter, app.clock.lost)
        radio.keep(radio.ride, self._views[size])
        if self._intervals[OWN]:
            self._put(radio.ride, size)
        self._idle_s = 0 if self.period_ms else self._idle_s + 1
        if self._idle_s > _IDLE_S:
            radio.drop()
        radio.save_bonds()

    def _put(self, handle, size):
        self._sent += self.radio.send(handle, self._views[size])

    def _state(self, lean):
        """Return the bits of the state, see pack_now()."""
        app, meter = self._app, self._app.meter
        flags = meter.calibration.aligned, lean is not None, meter.at_rest, meter.fallen
        flags += app.recording, not app.settings.leans, app.sensor.fault is not None
        return sum([bool(flags[bit]) << bit for bit in range(7)])

    def _send(self, now_ms):
        """Send the packets whose time has come, with the means of the samples since the last call. Without new samples
        send nothing."""
        period_ms = self.period_ms
        self._due_ms = ticks_add(self._due_ms, period_ms)
        # The next packet is already due: the loop is late by more than a period
        if ticks_diff(now_ms, self._due_ms) >= 0:
            self._due_ms = ticks_add(now_ms, period_ms)
        if not self._n:
            return
        self._mean()
        lean, drive = self._app.lean_deg, self._app.drive
        self._sigma = degrees(sqrt(self._app.meter.filter.variance)) if lean is not None else None
        self._speed = drive.fresh_speed(now_ms) if drive else None
        intervals, dues = self._intervals, self._dues
        for packet in range(4):
            interval = intervals[packet]
            late_ms = ticks_diff(now_ms, dues[packet])
            # send now if the next call would be farther from the scheduled time
            if interval and 2 * late_ms >= -period_ms:
                dues[packet] = ticks_add(now_ms, interval - (late_ms if late_ms < period_ms else 0))
                self._send_one(packet, lean, now_ms)

    def _mean(self):
        """Compute the mean force and rate since the last call. The mean acts as the low-pass for this packet rate."""
        n = self._n
        for i in range(7):
            self._scaled[i] = self._sums[i] * _SAMPLES // n
        self._clear()
        self._app.meter.transform.apply_sum(self._scaled, _SAMPLES, self._force, self._rate)
        for i in range(3):
            self._rate[i] = degrees(self._rate[i])

    def _send_one(self, packet, lean, now_ms):
        radio, buffer, sigma, speed = self.radio, self._buffer, self._sigma, self._speed
        aligned = self._app.meter.calibration.aligned
        if packet == OWN:
            force = self._force if aligned else None  # without an alignment the force is in the sensor's axes
            state = self._state(lean)
            self._put(radio.now, packets.pack_now(buffer, now_ms, lean, sigma, force, self._rate, speed, state))
        elif packet == LEAN and lean is not None:
            self._put(radio.chrono, packets.pack_lean(buffer, lean, sigma))
        elif packet == MOTION and aligned:
            self._put(radio.chrono, packets.pack_motion(buffer, self._force, self._rate, lean is not None))
        elif packet == SPEED and speed is not None:
            self._put(radio.chrono, packets.pack_speed(buffer, speed))

    def lines(self):
        """Return the two lines of the page Live. The lines show the receiver and the number of packets per second."""
        who = self.asked or ("a phone" if self.radio.phone is not None else "no phone")
        return "BLE %12s" % who, "%4d packets/s" % self.per_second

    def stop(self):
        """Switch Live off until the next power-on. The menu also calls this method."""
        self.radio.stop()
        self._app.live = None
