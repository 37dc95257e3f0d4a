"""The simulated board: register-level models of the MPU6050, the display, button, GPS, wheel contact and I2C wires.

Plain Python that CPython and MicroPython both run. The models serve the demo and the tests with a fake `machine`
module (fakes/), and the emulated Pico (../emulator), which runs MicroPython's own.
"""
