"""The simulated board: register-level models of the MPU6050, the displays, button, GPS, wheel contact and I2C wires.

The models are plain Python, which CPython and MicroPython can both run. The demo and the tests use them with a fake
`machine` module (fakes/). The emulated boards (kickstand_emulator) use them with MicroPython's own `machine`.
"""
