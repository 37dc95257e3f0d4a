"""A ride to the console instead of the flash, for `kickstand record`: lines of base64, a '.' after each block."""

from binascii import b2a_base64

LENGTH = 512  # a block of half a second


class RideStream:
    """Takes the place of a RideRing."""

    stops_interrupts = False

    def begin(self):
        return 0

    def next_length(self):
        return LENGTH

    def room(self):
        return None

    def ready(self):
        return True

    def write(self, piece):
        print(b2a_base64(piece).decode(), end="")

    def end_block(self):
        print(".")

    def end(self):
        pass

    def abandon(self):
        pass

    def fault_code(self, error):
        return "usb-fault"
