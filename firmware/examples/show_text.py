"""Shows two lines on the display, and counts the seconds.

The firmware must be on the board (`kickstand flash`). Then, on your computer:

    mpremote run firmware/examples/show_text.py

The display shows:

    Hello, rider!
    on for 12 s

You may unplug the display and plug it in again: the program finds it and sets it up automatically. `mpremote reset`
starts the lean meter again.
"""

from time import sleep_ms, ticks_diff, ticks_ms

from kickstand import settings

lcd = settings.load().open_lcd()  # on the pins of the board's config.py
start_ms = ticks_ms()

while True:
    now_ms = ticks_ms()
    seconds = ticks_diff(now_ms, start_ms) // 1000
    # this stores the text and sends nothing yet; for a degree sign write "\xdf"
    lcd.show("Hello, rider!", "on for %d s" % seconds)
    lcd.tick(now_ms)  # sends the changes, at most one line at a time
    sleep_ms(10)
