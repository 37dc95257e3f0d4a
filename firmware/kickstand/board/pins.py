"""The usual pins of each board, and the pins that its chip itself needs. The defaults and checks of the settings use
this module, then settings.py removes it to free heap."""

import sys

from . import port

if port.IS_ESP32:
    _KNOWN = port.MACHINE.startswith("Generic ESP32 module")  # ESP32-DevKitC and similar, with the classic chip
    SENSOR_PINS, LCD_PINS, BUTTON_PIN = (21, 22), (18, 19), 4  # (SDA, SCL)
    GPS_UART, GPS_PINS, WHEEL_PIN = 2, (17, 16), 27  # (TX, RX)
    if "SPIRAM" in port.MACHINE:  # MicroPython's image for PSRAM uses pins 16 and 17 itself, and has no Pin for them
        GPS_PINS = None, None
    I2C_NUMBERED = False  # see port.open_i2c()
    SD_SPI = (2, 3)  # slots of machine.SDCard that use SPI
    # Pins that the chip itself needs. An output on a pin of the chip's USB disconnects the board from the computer
    # until BOOT is held. An output on a pin of a classic chip's flash (6 to 11) crashes the board at each start. Pins 1
    # and 3 of a classic chip are the console. ESP32-PICO-D4 and D2WD have their flash on 16 and 17, too (data sheet of
    # the PICO-D4, section 2.2).
    _CHIP = port.MACHINE.split(" with ESP32")[-1].lstrip("-")[:2]  # "S2", "C3", ...; classic: "", "UN", "D2" or "PI"
    _CLASSIC = not (_CHIP[:1] in ("S", "C", "H", "P") and _CHIP[1:].isdigit())
    TAKEN_PINS = {
        "S2": (19, 20), "S3": (19, 20), "C3": (18, 19), "C5": (13, 14), "C6": (12, 13), "H2": (26, 27), "P4": (24, 25),
    }.get(_CHIP, (1, 3, 6, 7, 8, 9, 10, 11) if _CLASSIC else ())  # fmt: skip
    if "PICO-D4" in port.MACHINE or "D2WD" in port.MACHINE:
        TAKEN_PINS += 16, 17
        GPS_PINS = None, None
    INPUT_PINS = (34, 35, 36, 37, 38, 39) if _CLASSIC else ()  # pins without output and without pull-up
else:  # Raspberry Pi Pico and Pico 2, and boards of other makers with the same pins and name
    _KNOWN = sys.platform != "rp2" or "Pico" in port.MACHINE
    SENSOR_PINS, LCD_PINS, BUTTON_PIN = (4, 5), (6, 7), 15
    GPS_UART, GPS_PINS, WHEEL_PIN = 1, (8, 9), 14
    I2C_NUMBERED = True  # two I2C buses must have two different controller numbers
    SD_SPI = (0, 1)  # the numbers of machine.SPI
    TAKEN_PINS = INPUT_PINS = ()
if not _KNOWN:  # an unknown board may lack these pins or use them for something else
    SENSOR_PINS = LCD_PINS = GPS_PINS = None, None
    BUTTON_PIN = WHEEL_PIN = None
    GPS_UART = 1
