"""Lists the boards that can be simulated: their names in MicroPython, and their chips' pins and I2C controllers.

Sources: data sheets of the chips; mpconfigboard.h of each board in ports/rp2/boards and ports/esp32/boards of
MicroPython.
"""

# {short name: sys.implementation._machine of the board}
MACHINES = {
    "pico": "Raspberry Pi Pico with RP2040",
    "pico w": "Raspberry Pi Pico W with RP2040",
    "pico 2": "Raspberry Pi Pico2 with RP2350",
    "pico 2 w": "Raspberry Pi Pico2 W with RP2350",
    "pico lipo": "Pimoroni Pico LiPo 4MB with RP2040",
    "xiao rp2040": "Seeed Studio XIAO RP2040 with RP2040",
    "esp32": "Generic ESP32 module with ESP32",
    "esp32 spiram": "Generic ESP32 module with SPIRAM with ESP32",
    "esp32 unicore": "Generic ESP32 module with ESP32-UNICORE",
    "lora32": "LILYGO TTGO LoRa32 with ESP32",
    "s2": "Generic ESP32S2 module with ESP32-S2",
    "s2 mini": "LOLIN_S2_MINI with ESP32-S2FN4R2",
    "s3": "Generic ESP32S3 module with ESP32-S3",
    "s3 of 1.25": "Generic ESP32S3 module with ESP32S3",  # as in MicroPython 1.25
    "c3": "ESP32C3 module with ESP32-C3",
    "c6": "ESP32C6 module with ESP32-C6",
    "h2": "ESP32H2 module with ESP32-H2",
}
# (first, last) GPIO numbers that machine.Pin accepts. Keys are the ends of the chips' names, "" for the classic ESP32
_ESP32_PINS = {
    "": ((0, 23), (25, 27), (32, 39)),
    "S2": ((0, 21), (33, 46)),
    "S3": ((0, 21), (33, 48)),
    "C3": ((0, 10), (18, 21)),
    "C6": ((0, 23),),
    "H2": ((0, 5), (8, 14), (22, 27)),
}


def pins_of(machine):
    """Return the GPIO numbers that machine.Pin accepts. On a classic ESP32 these numbers include the flash's pins."""
    ranges = ((0, 29),) if _chip(machine).startswith("RP2") else _ESP32_PINS[_kind(machine)]
    pins = frozenset(pin for first, last in ranges for pin in range(first, last + 1))
    return pins - {16, 17} if "SPIRAM" in machine else pins


def flash_pins(machine):
    """Return the pins in pins_of() that are connected to the program's flash."""
    return frozenset(range(6, 12)) if _is_classic(machine) else frozenset()


def inputs_only(machine):
    """Return the pins that have neither an output nor a pull-up."""
    return frozenset(range(34, 40)) if _is_classic(machine) else frozenset()


def i2c_controllers(machine):
    """Return the number of I2C controllers that machine.I2C can use."""
    return 1 if _chip(machine)[:7] in ("ESP32C3", "ESP32C6") else 2  # machine.I2C lacks the C6's low-power controller


def has_bluetooth(machine):
    """Return True if MicroPython for this board has the module bluetooth."""
    chip = _chip(machine)
    return " W with " in machine if chip.startswith("RP2") else not chip.startswith("ESP32S2")


def _is_classic(machine):
    return _chip(machine).startswith("ESP32") and not _kind(machine)


def _kind(machine):
    kind = _chip(machine)[5:7]
    return kind if kind in _ESP32_PINS else ""


def _chip(machine):
    return machine[machine.rindex(" with ") + 6 :].replace("-", "")
