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
        """Writes a ride to the console. It has the methods of RideFiles (kickstand.rides)."""

        stops_interrupts = False

        def begin(self):
            self._slow_ms = None
            return 0  # the number of the ride

        def next_length(self):
            return 512  # bytes in a block, about half a second of a ride

        def room(self):
            return None  # no limit

        def ready(self):
            return True

        def write(self, data):
            self._say(b2a_base64(data).decode())

        def end_block(self):
            self._say(".\n")

        again = end_block  # the computer skips the interrupted block

        def _say(self, text):
            if not say(text, ""):
                return
            before_ms, self._slow_ms = self._slow_ms, ticks_ms()
            if before_ms is not None and 0 <= ticks_diff(self._slow_ms, before_ms) < 60_000:
                raise OSError(ETIMEDOUT)

        def end(self):
            pass

        def abandon(self):
            pass

        def fault_code(self, error):
            return "out-of-memory" if isinstance(error, MemoryError) else "usb-fault"

    chosen = settings.load()
    print("vehicle", chosen.VEHICLE)
    try:
        App(chosen, chosen.open_lcd(), chosen.open_sensor(), RideStream()).run()
    except KeyboardInterrupt:
        port.rest_watchdog()
