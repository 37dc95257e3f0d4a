"""A page with the voltage of the bike's battery. The page needs neither sensor nor alignment.

Copy it to the board as user.py, and restart (the firmware must be on the board; an update leaves user.py alone):

    mpremote cp firmware/examples/user_battery.py :user.py
    mpremote reset

Wiring: connect the battery's + through 100 kOhm to GPIO 26 (ADC 0 of a Pico; GPIO 34 on an ESP32). Connect 10 kOhm and
100 nF from this pin to ground. 12 V must never reach a pin without the divider. Without a board:
kickstand try firmware/examples/user_battery.py
"""

from machine import ADC, Pin

DIVIDER = (100_000 + 10_000) / 10_000
adc = ADC(Pin(26))


def page(app):
    """Return two lines of at most 16 characters."""
    volts = adc.read_u16() * 3.3 / 65_535 * DIVIDER
    word = "charging" if volts > 13.2 else "low!" if volts < 11.8 else "ok"
    return "Battery  %4.1f V" % volts, word
