"""The judge of faulty axes, with notes that are written by hand."""

from typing import Any

import pytest
from kickstand.errors import Notice
from kickstand.imu import axis_judge
from kickstand.imu.axis_judge import AxisJudge

ENDS, CLIPPED, GYRO_CLIPPED, DIFFER, SHAKEN, SEEN = 5, 6, 7, 8, 11, 19
HIGH, WRAPPED = 0x10000, 0x20000
GOOD = 0b1111 | HIGH  # notes of a good axis: four values, odd and even, and a changed high byte


def notes(**changed) -> list[int]:
    """Return the notes of a look in which all axes work; seen: {column: values}."""
    made = [0] * 33
    made[DIFFER] = 0b1110111
    for column in (0, 1, 2, 4, 5, 6):
        made[SEEN + column] = changed.get("seen", {}).get(column, GOOD)
    for name, index in (
        ("ends", ENDS),
        ("clipped", CLIPPED),
        ("gyro", GYRO_CLIPPED),
        ("differ", DIFFER),
        ("shaken", SHAKEN),
    ):
        made[index] = changed.get(name, made[index])
    return made


class Watch:
    def __init__(self):
        self.fault: Any = None
        self.notice: Any = None
        self.clipped = self.looks = 0
        self.notes: list[int] = []

    def look(self, judge, samples=100, **changed):
        self.notes = notes(**changed)
        self.looks += 1
        return judge.look(self, samples)


def words(notice):
    return notice and (notice.code, *notice.values)


def after(count, gyro_range=1, dlpf=3, **changed):
    """Return the fault after this number of equal looks."""
    judge, watch = AxisJudge(gyro_range, dlpf), Watch()
    for _ in range(count):
        watch.look(judge, **changed)
    return words(watch.fault)


@pytest.mark.parametrize(
    ("gyro_range", "dlpf", "column", "looks", "fault"),
    [
        (1, 3, 0, 1, ("axis-ill", "Accel", "x", "stuck")),
        (1, 3, 6, 1, ("axis-ill", "Gyro", "z", "dead")),
        (1, 5, 1, 15, ("axis-ill", "Accel", "y", "stuck")),
        (0, 6, 4, 11, ("axis-ill", "Gyro", "x", "dead")),
        (2, 4, 5, 10, ("axis-ill", "Gyro", "y", "dead")),
        (3, 3, 4, 14, ("axis-ill", "Gyro", "x", "dead")),
        (1, 6, 2, 80, ("axis-ill", "Accel", "z", "stuck")),
        (2, 5, 4, 62, ("axis-ill", "Gyro", "x", "dead")),
        (0, 4, 6, 3, ("axis-ill", "Gyro", "z", "dead")),
        (1, 4, 0, 4, ("axis-ill", "Accel", "x", "stuck")),
    ],
)
def test_an_axis_without_noise_is_ill_after_its_looks(gyro_range, dlpf, column, looks, fault):
    seen = {column: 0b0001}
    assert after(looks, gyro_range, dlpf, seen=seen) == fault
    if looks > 1:
        assert after(looks - 1, gyro_range, dlpf, seen=seen) is None


def test_an_axis_whose_noise_is_too_small_is_not_judged():
    assert after(300, 3, 6, seen={4: 1}) is None and after(300, 2, 6, seen={6: 1}) is None
    assert after(300, 3, 4, seen={5: 1}) is None


@pytest.mark.parametrize(
    ("values", "ill"),
    [
        (0b0001, True),
        (0b0011, True),
        (0b0111, False),
        (0b0101_0101, True),
        (0b1010_1010, True),
        (0b1011, False),
        (0, True),
    ],
)
def test_an_axis_has_three_values_with_both_lowest_bits(values, ill):
    assert (after(1, seen={0: values | HIGH}) is not None) is ill


def test_a_stuck_high_byte_wraps_in_two_looks():
    wrapped = {2: 0b1111 | WRAPPED}
    assert after(1, seen=wrapped) is None and after(2, seen=wrapped) == ("axis-ill", "Accel", "z", "stuck")
    judge, watch = AxisJudge(1, 3), Watch()
    for seen in (wrapped, {}, wrapped):
        watch.look(judge, seen=seen)
    assert watch.fault is None  # the empty look between means that the high byte changed, which restarts the count
    watch.look(judge, seen=wrapped)
    assert watch.fault is not None


@pytest.mark.parametrize(
    ("bit", "sensor", "axes"),
    [
        (0, "Accel", "xz"),
        (1, "Accel", "xy"),
        (2, "Accel", "yz"),
        (4, "Gyro", "xz"),
        (5, "Gyro", "xy"),
        (6, "Gyro", "yz"),
    ],
)
def test_two_equal_axes_are_ill(bit, sensor, axes):
    assert after(1, differ=0b1110111 & ~(1 << bit)) == ("axis-ill", sensor, axes, "equal")
    assert after(1, 1, 6, differ=0b1110111 & ~(1 << bit)) is None  # with a slow low-pass, equal axes are not judged


def test_the_gyros_axes_are_named_before_the_accelerometers():
    assert words(axis_judge._ill(0b1000001)) == ("axis-ill", "Gyro", "z", "dead")
    assert words(axis_judge._ill(0b0000101)) == ("axis-ill", "Accel", "xz", "stuck")
    assert words(axis_judge._ill(0b0110001, "equal")) == ("axis-ill", "Gyro", "xy", "equal")


@pytest.mark.parametrize(
    ("given", "notice", "fault"),
    [
        ({"clipped": 9}, None, None),
        ({"clipped": 10}, ("clips", "Accel"), None),
        ({"shaken": 9}, None, None),
        ({"clipped": 10, "gyro": 5}, ("clips", "Gyro"), None),
        ({"clipped": 10, "gyro": 4}, ("clips", "Accel"), None),
        ({"shaken": 10}, ("clips", "Accel"), ("clips", "Accel")),
        ({"clipped": 49}, ("clips", "Accel"), None),
        ({"clipped": 50}, ("clips", "Accel"), ("clips", "Accel")),
    ],
)
def test_samples_at_the_end_of_the_range_clip(given, notice, fault):
    """A notice appears if a tenth of the samples clip. A fault is reported if half of the samples clip in two looks, or
    if the sensor is shaken."""
    judge, watch = AxisJudge(1, 3), Watch()
    watch.look(judge, **given)
    assert words(watch.notice) == notice and watch.fault is None
    watch.look(judge, **given)
    assert words(watch.fault) == fault and watch.clipped == 2 * given.get("clipped", 0)
    assert [watch.notes[k] for k in (ENDS, CLIPPED, GYRO_CLIPPED, DIFFER, SHAKEN)] == [0] * 5


def test_few_clipped_samples_end_the_count_of_looks():
    for between, fault in ((24, None), (25, ("clips", "Accel"))):
        judge, watch = AxisJudge(1, 3), Watch()
        for clipped in (50, between, 50):
            watch.look(judge, clipped=clipped)
        assert words(watch.fault) == fault


def test_an_axis_at_the_end_of_the_range_for_five_looks_is_ill():
    for count, fault in ((4, ("clips", "Accel")), (5, ("axis-ill", "Accel", "y", "stuck"))):
        assert after(count, clipped=100, ends=0b10) == fault
    assert after(5, clipped=99, ends=0b10) == ("clips", "Accel")


def test_two_good_looks_end_a_fault():
    judge, watch = AxisJudge(1, 3), Watch()
    assert watch.look(judge, seen={0: 1}) is True and watch.fault
    assert watch.look(judge) is False and watch.fault
    watch.look(judge, clipped=50)  # the look has too few good samples
    assert watch.fault
    judge, watch = AxisJudge(1, 3), Watch()
    watch.look(judge, seen={0: 1})
    watch.look(judge)
    watch.look(judge)
    assert watch.fault is None


def test_a_faulty_axis_is_set_up_every_25_looks():
    judge, watch = AxisJudge(1, 3), Watch()
    asked = [k for k in range(60) if watch.look(judge, seen={0: 1})]
    assert asked == [0, 25, 50]


def test_a_notice_is_shown_again_after_150_looks():
    judge, watch = AxisJudge(1, 3), Watch()
    shown = []
    for k in range(302):
        watch.notice = None
        watch.look(judge, clipped=10)
        if watch.notice:
            shown.append(k)
    assert shown == [0, 150, 300]
    watch.notice, watch.looks = None, 400
    judge._show(watch, Notice("other"))
    assert watch.notice is not None
