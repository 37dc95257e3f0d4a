"""The whole device on the emulated Pico: MicroPython's own image, its file system, floats and drivers."""

import pytest
from emulated import firmware, pico, shown_lean, shows
from kickstand_tools.simulation.scripted.script import Ride, kickstand, upright
from kickstand_tools.simulation.scripted.sensor_errors import Sensor
from kickstand_workshop.bench.sample_count import SampleCount

pytestmark = pytest.mark.chip

LEAN_DEG = 20.0


@pytest.mark.long
def test_a_new_board_is_aligned_by_two_presses_and_keeps_it():
    """Uncalibrated, kickstand, upright, power-cycle, leaned: the display reads the lean."""
    ride = Ride([kickstand(5.5), upright(5.5), upright(1e6, lean_deg=LEAN_DEG)])
    part = Sensor(seed=1, share=0.1)  # its accelerometer is not calibrated here: that shall cost no degrees
    device = pico(part.world(ride.motion), firmware())
    device.power_on()
    shows(device, r"Raw.*\|(Not aligned|On stand: press)", 1.5)
    samples = SampleCount(device.board.sensor)
    samples.begin()
    device.press()
    shows(device, r"Now upright: ", 4.5)
    device.run_until(lambda: ride.truth(device.time_s)[3] == "upright", 4.0)
    device.press()
    tilt = shows(device, r"Aligned! +(\d+\.\d)°", 4.5)
    assert 11.0 < float(tilt[1]) < 13.0
    assert {"kickstand_a.cal", "kickstand_b.cal"} & set(device.files())
    device.run(0.2)
    assert samples.taken() > 1000
    assert samples.lost() == 0  # while poses were taken and the flash was written

    device.power_off()
    device.run_until(lambda: ride.truth(device.time_s)[0] > LEAN_DEG - 1.0, 10.0)
    device.power_on()
    device.run_until(lambda: shown_lean(device.lcd()) is not None, 2.0)
    assert abs((shown_lean(device.lcd()) or 0.0) - LEAN_DEG) < 3.0
