"""Counts the samples of the simulated sensor, and the samples that are lost before the board reads them."""

from typing import Any

from kickstand_tools.simulated_board.mpu6050 import ACCEL_XOUT_H, Mpu6050


class SampleCount:
    """Counts the samples of one sensor. The board may read the data registers or the FIFO."""

    def __init__(self, sensor: Mpu6050) -> None:
        self._sensor: Any = sensor
        self._start, self._pop = sensor.start, sensor.fifo.pop
        sensor.start = self._on_start  # type: ignore[method-assign]
        sensor.fifo.pop = self._on_pop  # type: ignore[method-assign]
        self._first = self._waiting = self._popped = 0
        self._read: set[int] = set()

    def begin(self) -> None:
        """Begin to count."""
        self._sensor._update()
        self._first, self._waiting = self._sensor._next, self._sensor.fifo.count
        self._popped = 0
        self._read = set()

    def taken(self) -> int:
        """Return the number of samples that the sensor has taken."""
        self._sensor._update()
        return self._sensor._next - self._first

    def delivered(self) -> int:
        """Return the number of samples that the board has read."""
        return self._popped // (len(self._sensor._fifo_registers) or 1) or len(self._read)

    def lost(self) -> int:
        """Return the number of samples that are lost: overwritten, or removed from the FIFO before they were read."""
        samples = self.taken()  # taken() is called first, because it updates the FIFO
        frame = len(self._sensor._fifo_registers)
        if frame:
            accounted = self._popped + self._sensor.fifo.count - self._waiting
            return samples - accounted // frame
        return max(0, samples - 1 - len(self._read))  # the latest sample can still be read

    def _on_start(self, address: int, read: bool) -> bool:
        acknowledged = self._start(address, read)
        if read and self._sensor._pointer == ACCEL_XOUT_H:
            self._read.add(self._sensor._next)
        return acknowledged

    def _on_pop(self, count: int = 1) -> bytes:
        self._popped += min(count, self._sensor.fifo.count)
        return self._pop(count)
