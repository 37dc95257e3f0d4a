"""Prints the sensor's readings five times per second.

The firmware must be on the board (`kickstand flash`). Then, on your computer:

    mpremote run firmware/examples/print_sensor.py

The program prints acceleration and rate of rotation along the sensor's own x, y and z, and the temperature:

    -0.01  +0.02  +1.01 g     +0.3   -1.2   +0.1 deg/s   25.3 C

At rest the axis that points up shows about 1 g, and all three rates are small. The values are not calibrated.
Ctrl-C ends mpremote. The program continues until `mpremote reset`, which starts the lean meter again.
"""

from time import sleep_ms

from kickstand import settings

sensor = settings.load().open_sensor()  # pins and ranges as in the board's config.py
sensor.set_up()
chip = sensor.chip
print("Found an", chip.name)

while True:
    chip.read()
    ax, ay, az, temperature, gx, gy, gz = chip.counts
    g, dps = chip.accel_lsb_per_g, chip.gyro_lsb_per_dps  # counts in 1 g and in 1 deg/s
    print(
        "%+6.2f %+6.2f %+6.2f g   %+6.1f %+6.1f %+6.1f deg/s   %.1f C"
        % (ax / g, ay / g, az / g, gx / dps, gy / dps, gz / dps, chip.temperature_c(temperature))
    )
    sleep_ms(200)
