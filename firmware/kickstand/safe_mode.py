"""Safe mode: nothing is started, because the button was held at power-on."""

from time import sleep_ms

from .units import __version__, const

_LOOK_MS = const(100)


def report_safe_mode(lcd, button, pin, closed_ms):
    """Say on display and console that nothing is started. If the button is not released, say that it is closed.

    Args:
        lcd: the Display.
        button: the Button.
        pin: the GPIO number of the button.
        closed_ms: as for start.main().
    """
    print("Kickstand %s: safe mode, the button was held at power-up." % __version__)
    lcd.show("Safe mode", "Ready for USB")
    lcd.flush()
    for _ in range(closed_ms // _LOOK_MS):
        sleep_ms(_LOOK_MS)
        if not button.held():
            return
    if closed_ms:
        print("The button on GPIO %d stays closed: check its wires; turn a button with four legs by 90 degrees." % pin)
        lcd.show("Button is closed", "check its wires")
        lcd.flush()
