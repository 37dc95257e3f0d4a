"""A failing GPS receiver, or an attacker on its wire: sentences with correct checksums and random fields."""

import random

from kickstand_tools.simulated_board.simulator import Board
from support.board_access import level
from test_board_speed import Listing


def test_fields_from_nowhere_give_no_place_and_raise_nothing():
    """The checksums of these sentences are correct, but their fields are random."""
    chance = random.Random(3)
    fields = b"|-1|1e999|inf|nan|99999999999999999999|17959.9|9000.0|4899.0|4807.038|01131.000|235960.99".split(b"|")
    fields += b"-99999.0|246060.00|A|N|E|19.4|230394|999999|.|12|\xff".split(b"|")
    with Board(level):
        from kickstand.speed.gps import Gps

        wire, now_ms, places = Listing(b""), 1000, 0
        gps = Gps(wire)
        for second in range(3000):
            clock = f"{second // 3600:02}{second // 60 % 60:02}{second % 60:02}.00"
            parts = ("GPRMC," + clock + ",A,4807.038,N,01131.000,E,19.4,084.4,230394,003.1,W").encode().split(b",")
            for _ in range(chance.choice((0, 1, 1, 3))):
                parts[chance.randrange(1, len(parts))] = chance.choice(fields)
            body = b",".join(parts[: chance.choice((13, 13, 13, 8, 7, 3))])
            checksum = 0
            for byte in body:
                checksum ^= byte
            wire._data = b"$" + body + f"*{checksum:02X}\r\n".encode()
            now_ms += 1000
            while wire.any():
                gps.poll(now_ms)
                place = gps.place(now_ms)
                if place is not None:
                    places += 1
                    assert abs(place[2]) < 90 * 6_000_000 and abs(place[3]) < 180 * 6_000_000, body
                    assert 0 <= place[1] <= 86_401_000, body
        assert places > 300
