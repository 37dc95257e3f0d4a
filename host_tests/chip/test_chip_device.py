"""The whole device on the emulated Pico: MicroPython's own image, its file system, floats and drivers."""

import time

import pytest
from emulated import calibrated, firmware, leaning, pico, shown_lean, shows
from kickstand_tools.simulation.scripted.script import Ride, accelerate, kickstand, turn, upright, wait
from kickstand_tools.simulation.scripted.sensor_errors import Sensor
from kickstand_workshop.bench.sample_count import SampleCount

pytestmark = pytest.mark.chip

KICKSTAND, UPRIGHT, RIDE = 5.5, 5.5, [wait(2.0), accelerate(15.0, 3.0), turn(-30.0, 3.0)]  # standing: the bias is found


@pytest.mark.long
def test_a_new_board_is_aligned_by_two_presses_and_keeps_it():
    """Uncalibrated, kickstand, upright, power-cycle, ride: the display reads the lean."""
    ride = Ride([kickstand(KICKSTAND), upright(UPRIGHT), *RIDE])
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

    device.power_cycle()
    device.run_until(lambda: shown_lean(device.lcd()) is not None, 2.0)
    device.run_until(lambda: ride.truth(device.time_s)[3] == "held turn", 8.0)
    device.run(1.0)  # for the averages
    errors = []
    while ride.truth(device.time_s)[3] == "held turn":
        errors.append((shown_lean(device.lcd()) or 0.0) - ride.truth(device.time_s)[0])
        device.run(0.1)
    assert len(errors) > 10
    assert max(abs(error) for error in errors) < 3.0


def test_its_pages_follow_the_button():
    """The contacts bounce, but each press turns one page."""
    device = pico(leaning(20.0), firmware() | calibrated())
    device.power_on()
    device.run_until(lambda: shown_lean(device.lcd()) is not None, 2.0)
    assert shown_lean(device.lcd()) in (19.0, 20.0, 21.0)
    titles = ["Lean"]
    while titles[-1] != "Lean" or len(titles) == 1:
        device.press()
        device.run(0.5)
        titles.append(device.lcd()[0].split()[0])
        assert len(titles) < 8
    assert len(titles) - 1 == len(set(titles)) > 3


def test_the_same_program_takes_the_same_time_on_every_host():
    """A slow host emulates the same cycles."""

    def cycles(pause_s):
        device = pico(leaning(0.0), firmware() | calibrated())
        device.power_on()
        device.run(0.8, lambda: time.sleep(pause_s))
        return device.chip.rp2040.core.cycles

    assert cycles(0.0) == cycles(0.003)
