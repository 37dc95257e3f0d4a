"""Which fault is reported if several devices answer on the sensor's bus, and how a broken FIFO is recognised."""

import pytest
from kickstand_tools.simulated_board.other_devices import Registers
from support.board_access import on_board


def explained(*devices, error=None, sensor=False):
    """Return (code, values) of the Notice and the addresses on a bus with these devices, instead of the sensor."""
    found = []

    def program(board):
        from kickstand.devices import open_bus, open_sensor
        from kickstand.diagnosis import explain_sensor
        from kickstand.imu.mpu6050 import NotKept
        from kickstand.settings import Settings

        settings = Settings()
        if not sensor:
            board.remove_sensor()
        for device in devices:
            board.sensor_bus.attach(device)
        chip = open_sensor(settings).chip
        chip.address = 0x69
        failed = NotKept() if error == "not kept" else OSError(5)
        notice, addresses = explain_sensor(4, 5, lambda: open_bus(settings, "SENSOR", 400_000), chip, failed)
        found.append((notice.code, notice.values, addresses))

    assert on_board(program, 10.0)[0] == "returned"
    return found[0]


LSM6, BMI160 = (0x6A, {0x0F: 0x6C}), (0x69, {0x00: 0xD1})
BAROMETER, DISPLAY, UNKNOWN = (0x76, {}), (0x27, {}), (0x42, {})
MPU_68, MPU_69 = ({0x75: 0x68, 0x6B: 0x40},) * 2


@pytest.mark.parametrize(
    ("devices", "code", "values"),
    [
        ([], "no-sensor", (4, 5)),
        ([DISPLAY, UNKNOWN], "no-sensor", (4, 5)),
        ([(0x08, {})], "no-sensor", (4, 5)),
        ([(0x77, {})], "other-device", ("barometer", 0x77)),
        ([DISPLAY, BAROMETER], "other-device", ("barometer", 0x76)),
        ([BAROMETER, LSM6], "other-chip", ("LSM6DSO", 0x6A)),
        ([(0x68, MPU_68), LSM6], "other-chip", ("LSM6DSO", 0x6A)),
        ([BAROMETER, (0x69, MPU_69)], "bus-errors", (0x69,)),
        ([BAROMETER, (0x68, {0x75: 0x12, 0x6B: 0x41})], "unknown-chip", (0x12,)),
        ([(0x68, {0x75: 0x00, 0x6B: 0x41})], "no-chip", (0x00, 0x68)),
        ([(0x69, {0x75: 0xFF, 0x6B: 0x41})], "no-chip", (0xFF, 0x69)),
        ([(0x68, {0x75: 0x01, 0x6B: 0x41})], "unknown-chip", (0x01,)),
    ],
)
def test_the_most_useful_fault_is_named(devices, code, values):
    made = [Registers(*device) for device in devices]
    assert explained(*made) == (code, values, sorted(device[0] for device in devices))


def test_a_chip_that_keeps_no_settings_is_named_before_the_others():
    devices = [Registers(0x69, {0x75: 0x12, 0x6B: 0x41}), Registers(*BAROMETER), Registers(*LSM6)]
    assert explained(*devices, error="not kept")[:2] == ("not-kept", (0x69,))
    assert explained(*devices)[:2] == ("other-chip", ("LSM6DSO", 0x6A))
    assert explained(Registers(*BMI160), error="not kept")[:2] == ("other-chip", ("BMI160", 0x69))


@pytest.mark.parametrize(
    ("devices", "line"),
    [
        ([], "Sensor bus   SDA 4, SCL 5: nothing answers"),
        ([(0x08, "", 0)], "Sensor bus   SDA 4, SCL 5: 0x08"),
        ([(0x68, "MPU6050", 2), (0x77, "barometer", 0)], "Sensor bus   SDA 4, SCL 5: 0x68 MPU6050, 0x77 barometer"),
    ],
)
def test_a_bus_is_one_line(devices, line):
    def program(board):
        from kickstand.diagnosis import bus_line

        assert bus_line("Sensor", 4, 5, devices) == line

    assert on_board(program)[0] == "returned"


def test_each_address_for_devices_is_asked():
    """The addresses below 0x08 and over 0x77 are reserved."""
    asked = []

    class Bus:
        def readfrom_into(self, address, buffer):
            asked.append(address)
            if address not in (0x08, 0x77):
                raise OSError(5)

    def program(board):
        from kickstand.diagnosis import answering

        assert answering(Bus()) == [0x08, 0x77]
        assert asked == list(range(0x08, 0x78))
        assert answering(Bus(), range(0x50, 0x78)) == [0x77]

    assert on_board(program)[0] == "returned"


class FifoChip:
    """Replaces an Mpu6050. waiting: the successive numbers of bytes in the FIFO. readings: the successive readings."""

    period_ms = 5

    def __init__(self, waiting, readings, status=0, frames=()):
        self._waiting, self._readings, self._status = list(waiting), list(readings), status
        self._frames, self.counts, self.written, self.emptied = list(frames), [0] * 7, [], 0

    def restart_fifo(self):
        self.emptied += 1

    def waiting(self):
        return self._waiting.pop(0)

    def write_register(self, register, value):
        self.written.append((register, value))

    def read_register(self, register):
        assert register == 0x3A
        return self._status

    def read(self):
        self.counts = [self._readings.pop(0) if self._readings else 0] * 7

    def fetch(self):
        return len(self._frames[0]) if self._frames else 0

    def take(self, k):
        self.counts = [self._frames[0][k]] * 7
        if k == len(self._frames[0]) - 1:
            self._frames.pop(0)


@pytest.mark.parametrize(
    ("chip", "how"),
    [
        (FifoChip([57, 60], [1, 2]), "stays full"),
        (FifoChip([56, 112], [1, 2, 3, 4]), None),
        (FifoChip([0, 0], [1, 2]), "stays empty"),
        (FifoChip([0, 0], [1, 1], status=1), "stays empty"),
        (FifoChip([0, 0], [1, 1], status=0), None),
        (FifoChip([14, 14], [1, 2]), "stands still"),
        (FifoChip([14, 0], [1, 2]), "stands still"),
        (FifoChip([0, 56], [1, 2, 3, 4], frames=[[5, 5], [5], [5, 5]]), "repeats"),
        (FifoChip([0, 56], [1, 2, 3, 3], frames=[[5, 5], [5], [5, 5]]), None),
        (FifoChip([0, 56], [1, 2, 3, 4], frames=[[5, 5], [5], [5, 6]]), None),
        (FifoChip([0, 56], [1, 2, 3, 4], frames=[[5], [6], [5]]), None),
        (FifoChip([0, 56], [1, 1], status=2, frames=[[5, 5], [5], [5]]), None),
    ],
)
def test_a_fifo_that_cannot_be_used_is_recognised(chip, how):
    """A frame has 14 bytes. Just after its restart the FIFO may hold at most four frames, and then four frames should
    arrive."""
    found = []

    def program(board):
        from kickstand.diagnosis import fifo_fault

        found.append(fifo_fault(chip))
        assert board.clock.now_us >= 20_000

    assert on_board(program)[0] == "returned"
    notice = found[0]
    assert (notice and (notice.code, notice.values)) == (how and ("sensor-fifo", (how,)))
    assert chip.written == [(0x38, 1), (0x38, 0)] and chip.emptied == 2
