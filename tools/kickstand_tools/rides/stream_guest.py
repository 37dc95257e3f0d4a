"""The program that `kickstand record` sends to the board."""


def stream():
    """Run the app with display and button, and send its ride over USB instead of writing it to flash. Ctrl-C ends it.

    Each line of the ride is base64. A '.' follows each block. A sleeping computer reads nothing, and each print waits
    half a second for the computer. The second slow print within a minute ends the ride.
    """
    from binascii import b2a_base64
    from errno import ETIMEDOUT
    from time import ticks_diff, ticks_ms

    from kickstand import settings
    from kickstand.app import App
    from kickstand.board import port
    from kickstand.console import say

    class RideStream:
        """Has the same methods as a RideFiles, but writes to the console."""

        stops_interrupts = False

        def begin(self):
            """Begin a ride. The number of the ride is always 0."""
            self._slow_ms = None
            return 0

        def next_length(self):
            """Return the number of bytes in a ride block over USB, about half a second of a ride."""
            return 512

        def room(self):
            """Return None, because there is no limit."""

        def ready(self):
            """Return True, because a block can be written at any time."""
            return True

        def write(self, data):
            """Write the next bytes of the block as one line. Raises OSError."""
            self._say(b2a_base64(data).decode())

        def end_block(self):
            """End a block: print the mark. Raises OSError."""
            self._say(".\n")

        def _say(self, text):
            if not say(text, ""):
                return
            before_ms, self._slow_ms = self._slow_ms, ticks_ms()
            if before_ms is not None and 0 <= ticks_diff(self._slow_ms, before_ms) < 60_000:
                raise OSError(ETIMEDOUT)

        def end(self):
            """End the ride. There is no file to close."""

        def abandon(self):
            """End the ride after an error. There is no file to close."""

        def fault_code(self, error):
            return "out-of-memory" if isinstance(error, MemoryError) else "usb-fault"

    chosen = settings.load()
    print("vehicle", chosen.VEHICLE)
    try:
        App(chosen, chosen.open_lcd(), chosen.open_sensor(), RideStream()).run()
    except KeyboardInterrupt:
        port.rest_watchdog()
