"""Registers, bits and times of the MPU6050, and the chips sold under its name.

RM-MPU-6000A rev 4.2, PS-MPU-6000A rev 3.4; MPU-6500 RM rev 2.1; ICM-20689 and MPU-6886 data sheets.
"""

from collections import namedtuple

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, ACCEL_CONFIG2 = 0x19, 0x1A, 0x1B, 0x1C, 0x1D
FIFO_EN, INT_ENABLE, INT_STATUS = 0x23, 0x38, 0x3A
ACCEL_XOUT_H, GYRO_ZOUT_L = 0x3B, 0x48
SIGNAL_PATH_RESET, USER_CTRL, PWR_MGMT_1 = 0x68, 0x6A, 0x6B
FIFO_COUNTH, FIFO_COUNTL, FIFO_R_W, WHO_AM_I = 0x72, 0x73, 0x74, 0x75
READ_ONLY = (INT_STATUS, FIFO_COUNTH, FIFO_COUNTL, FIFO_R_W, WHO_AM_I)  # and the data registers

RESET, SLEEP = 0x80, 0x40  # PWR_MGMT_1
FIFO_ENABLED, FIFO_RESET, SIG_COND_RESET = 0x40, 0x04, 0x01  # USER_CTRL
DATA_RDY, FIFO_OFLOW = 0x01, 0x10  # INT_STATUS

START_UP_US = 90_000  # after power-on and reset: the sheet's worst case is 100 ms
WAKE_US = 30_000  # from sleep to the first sample: gyro start-up time, PS 6.1
GYRO_LSB_PER_DPS = (131.0, 65.5, 32.8, 16.4)  # by range, GYRO_CONFIG bits 4 and 3
DLPF_DELAY_US = (980, 1900, 2800, 4800, 8300, 13400, 18600, 980)  # delay of the gyro's low-pass, by DLPF_CFG

# temperature in degrees C = counts / counts_per_c + zero_c.
# temperature_in_fifo: it goes into the FIFO with accelerometer and with gyro, whatever FIFO_EN says.
Variant = namedtuple(
    "Variant",
    ("power_after_reset", "counts_per_c", "zero_c", "has_accel_config2", "fifo_bytes", "temperature_in_fifo"),
)
VARIANTS = {  # by WHO_AM_I, the same ones as in CHIPS of firmware/kickstand/imu/mpu6050.py
    0x68: Variant(0x40, 340.0, 36.53, False, 1024, False),  # MPU6050
    0x70: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU6500
    0x71: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU9250
    0x72: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU6500 clone
    0x73: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU9255
    0x74: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU6515
    0x78: Variant(0x40, 333.87, 21.0, True, 512, False),  # MPU6500 clone
    0x98: Variant(0x40, 326.8, 25.0, True, 512, False),  # ICM20689
    0x19: Variant(0x40, 326.8, 25.0, True, 1024, True),  # MPU6886
}
