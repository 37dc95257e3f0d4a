"""Which of the samples that the simulated sensor takes leave it, and which are lost."""

from typing import Any

from ..board.mpu6050 import ACCEL_XOUT_H, Mpu6050


class SampleCount:
    """Watches one sensor from now on, read by register or through its FIFO."""

    def __init__(self, sensor: Mpu6050) -> None:
        self._sensor: Any = sensor
        self._start, self._push = sensor.start, sensor.fifo.push
        sensor.start = self._on_start  # type: ignore[method-assign]
        sensor.fifo.push = self._on_push  # type: ignore[method-assign]
        self._first = 0
        self._read: set[int] = set()
        self._pushed_out = 0

    def begin(self) -> None:
        """Count from here."""
        self._first = self._sensor._next
        self._read = set()
        self._pushed_out = 0

    def taken(self) -> int:
        """Samples the sensor took."""
        return self._sensor._next - self._first

    def lost(self) -> int:
        """Samples that nobody can read any more: overwritten, or pushed out of the FIFO."""
        frame = len(self._sensor._fifo_registers)
        if frame:
            return -(-self._pushed_out // frame)
        return max(0, self.taken() - 1 - len(self._read))  # the latest can still be read

    def _on_start(self, address: int, read: bool) -> bool:
        acknowledged = self._start(address, read)
        if read and self._sensor._pointer == ACCEL_XOUT_H:
            self._read.add(self._sensor._next)
        return acknowledged

    def _on_push(self, byte: int, keep_old: bool = False) -> bool:
        lost = self._push(byte, keep_old)
        self._pushed_out += lost
        return lost
