"""The firmware on an emulated Raspberry Pi Pico: the official MicroPython image, with the board's models.

with Pico(world, files=flash_image.firmware()) as pico:
    pico.run(2.0)
    pico.lcd()
"""
