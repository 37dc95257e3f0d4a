"""Sends the lean to another controller over a wire, in ten lines per second.

A line is 23.4 for a lean to the right, -23.4 for a lean to the left, and ? while the lean is not trusted.

Copy it to the board as user.py, and restart (the firmware must be on the board; an update leaves user.py alone):

    mpremote cp firmware/examples/user_uart.py :user.py
    mpremote reset

Wiring: connect GPIO 0 of a Pico (TX of UART 0) to RX of the other controller, and ground to ground. Both controllers
must use 3.3 V. On an ESP32 choose UART 1 and two free pins.
Without a board: kickstand try firmware/examples/user_uart.py
"""

from machine import UART, Pin

uart = UART(0, baudrate=115_200, tx=Pin(0), rx=Pin(1))


def on_lean(lean_deg, trusted, meter):
    """Send the lean. The firmware calls this function ten times per second. After a ? the receiver must not use the
    last number."""
    uart.write("%.1f\n" % lean_deg if trusted else "?\n")
