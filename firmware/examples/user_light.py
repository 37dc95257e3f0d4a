"""A lamp that lights when the bike leans more than 45 degrees to either side.

Copy it to the board as user.py, and restart (the firmware must be on the board; an update leaves user.py alone):

    mpremote cp firmware/examples/user_light.py :user.py
    mpremote reset

Wiring: connect an LED with 330 ohm between GPIO 16 of a Pico and ground. On an ESP32 choose another pin. For more than
10 mA use a transistor. Without a board: kickstand try firmware/examples/user_light.py
"""

from machine import Pin

LIMIT_DEG = 45
lamp = Pin(16, Pin.OUT, value=0)


def on_lean(lean_deg, trusted, meter):
    """Switch the lamp. The firmware calls this function ten times per second. The lamp is off while the lean is not
    trusted."""
    lamp.value(1 if trusted and abs(lean_deg) > LIMIT_DEG else 0)
