"""The MPU6050's tolerances, from data sheet PS-MPU-6000A rev 3.4, sections 6.1 and 6.2.

Plain Python for CPython and MicroPython: both models of the sensor's errors use it.
"""

MAX_OFFSET_G = (0.05, 0.05, 0.08)  # of the accelerometer, along x, y, z
MAX_SCALE_ERROR = 0.03  # of accelerometer and gyro
MAX_GYRO_BIAS_DPS = 20.0
