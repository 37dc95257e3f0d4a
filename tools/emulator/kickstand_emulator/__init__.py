"""An emulated Raspberry Pi Pico that runs the official MicroPython image, wired to the models of simulated_board.

The tests, `kickstand emulate`, `bench` and `replay --engine rp2040` use it. For example:

    with Pico(world, files=firmware_files.contents(firmware_files.PICO)) as pico:
        pico.run(2.0)
        pico.lcd()
"""

from . import native

native.install()  # must run before any import of rp2040py
