"""Writes a ride to the console instead of flash, for `kickstand record`: lines of base64, a '.' after each block."""

from binascii import b2a_base64

LENGTH = 512  # bytes in a block: half a second


class RideStream:
    """Takes the place of a RideRing: the same methods, for the console."""

    stops_interrupts = False

    def begin(self):
        """Begin a ride; its number is always 0."""
        return 0

    def next_length(self):
        """How many bytes the next block has to have."""
        return LENGTH

    def room(self):
        """Nothing to return, because there is no limit."""

    def ready(self):
        """True: a block can be written at any time."""
        return True

    def write(self, piece):
        """Write the next piece of the block, bytes, as a line."""
        print(b2a_base64(piece).decode(), end="")

    def end_block(self):
        """End a block."""
        print(".")

    def end(self):
        """End the ride: there is nothing to close."""

    def abandon(self):
        """End the ride after an error: there is nothing to close."""

    def fault_code(self, error):
        return "usb-fault"
