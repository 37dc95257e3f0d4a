"""A failing GPS receiver, or an attacker on its wire: right checksums around wrong fields."""

from hypothesis import given, strategies as st
from kickstand_sim.simulated_board.simulator import Board
from speed_runs import Wire
from support.board_access import level

FIELDS = b"|-1|1e999|inf|nan|99999999999999999999|17959.9|9000.0|4899.0|-99999.0|235960.99|246060.00|A|N|.|12|\xff"
FIXES = st.lists(
    st.tuples(
        st.lists(st.tuples(st.integers(1, 11), st.sampled_from(FIELDS.split(b"|"))), max_size=3),
        st.sampled_from((13, 13, 8, 7, 3)),
    ),
    max_size=20,
)


@given(FIXES)
def test_wrong_fields_give_no_place_off_the_earth_and_raise_nothing(fixes):
    with Board(level):
        from kickstand.speed.gps import Gps

        wire, now_ms = Wire(), 1000
        gps = Gps(wire)
    for second, (changes, count) in enumerate(fixes):
        fields = f"GPRMC,1200{second:02}.00,A,4807.038,N,01131.000,E,19.4,084.4,230394,003.1,W".encode().split(b",")
        for k, field in changes:
            fields[k] = field
        body = b",".join(fields[:count])
        checksum = 0
        for byte in body:
            checksum ^= byte
        wire.data = b"$" + body + f"*{checksum:02X}\r\n".encode()
        now_ms += 1000
        while wire.any():
            gps.poll(now_ms)
            position = gps.place(now_ms)
            if position is not None:
                assert abs(position[2]) < 90 * 6_000_000 and abs(position[3]) < 180 * 6_000_000
                assert 0 <= position[1] <= 86_401_000
