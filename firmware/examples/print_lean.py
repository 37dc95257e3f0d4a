"""Prints the lean of the bike ten times per second. The program shows how to use the lean meter's mathematics in your
own code.

The firmware must be on the board (`kickstand flash`), and the bike aligned with it once. Then, on your computer,
`mpremote run firmware/examples/print_lean.py` shows the lean, positive to the right, and the forward acceleration:

    lean  +23.4 deg   forward -0.12 g     or "not sure yet" while the lean may not be shown

Ctrl-C ends mpremote. The program continues until `mpremote reset`, which starts the lean meter again.
"""

from time import sleep_ms

from kickstand import settings
from kickstand.calibration.store import Store
from kickstand.imu.mpu6050 import GYRO_DELAY_S
from kickstand.lean.meter import LeanMeter

config = settings.load()
sensor = config.open_sensor()
sensor.set_up()  # from now on the chip samples on its own, SAMPLE_HZ times per second
chip = sensor.chip

calibration = Store(chip.who_am_i, chip.accel_range_g).load()  # stored in flash by the lean meter
calibration.set_scale(chip.accel_lsb_per_g, chip.gyro_lsb_per_dps)
if not calibration.aligned:
    print("Not aligned: align the bike first, because without an alignment no lean is shown.")
meter = LeanMeter(calibration, delay_s=GYRO_DELAY_S[config.DLPF])

while True:
    for _ in range(10):
        sleep_ms(10)  # the chip keeps its samples for up to 0.17 s
        n = chip.add_up(chip.fetch())
        if n:
            meter.update_sum(chip.sums, n, n * 1_000_000 // config.SAMPLE_HZ)
    shown = meter.shown_deg()
    lean = "not sure yet   " if shown is None else "lean %+6.1f deg" % shown
    print("%s   forward %+.2f g" % (lean, meter.smooth_force[2]))
