"""The texts of the page for alignment by driving, in each state."""

from types import SimpleNamespace

import pytest
from kickstand.drive_alignment import alignment
from kickstand.errors import Notice, Refusal
from kickstand.ui import drive_page

DEGREE = "\xdf"


def shown(
    state=alignment.WAITING_FOR_BRAKING, problem=None, result=None, fault=None, counted=2, ready=False, quality=1.2
):
    drive = SimpleNamespace(problem=problem, ready=ready, counted=counted, needed=6, quality_deg=quality)
    speed = SimpleNamespace(source=SimpleNamespace(fault=lambda now_ms: fault))
    return drive_page.lines(SimpleNamespace(drive=drive, result=result, state=state, speed=speed), 0)


DONE = Notice("aligned", 0.4)


@pytest.mark.parametrize(
    ("given", "lines"),
    [
        ({}, ("Brakings   2/6", "brake straight")),
        ({"state": alignment.BRAKING}, ("Brakings   2/6", "braking...")),
        ({"state": alignment.TURNING}, ("Brakings   2/6", "turn not counted")),
        ({"state": alignment.WAITING_FOR_STOP, "counted": 0}, ("Brakings   0/6", "stop needed")),
        ({"state": alignment.WAITING_FOR_SPEED}, ("Align by drive", "waiting: speed")),
        ({"state": alignment.WAITING_FOR_SPEED, "fault": Notice("gps-silent")}, ("GPS silent", "check wiring")),
        ({"fault": Notice("gps-silent")}, ("Brakings   2/6", "brake straight")),
        ({"counted": 6}, (f"Brake  6 +- 1.2{DEGREE}", "brake straight")),
        ({"counted": 6, "quality": 180.0}, (f"Brake  6 +-99.9{DEGREE}", "brake straight")),
        ({"state": alignment.READY, "counted": 6}, ("Ready:", "stop to save it")),
        ({"problem": Refusal("speed-negative")}, ("Speed negative", "Check its source")),
        # The page shows the last result until new braking events count.
        ({"result": DONE, "counted": 0}, ("Aligned by drive", f"error about 0.4{DEGREE}")),
        ({"result": DONE, "counted": 1}, ("Brakings   1/6", "brake straight")),
        ({"result": DONE, "counted": 6, "ready": True}, ("Aligned by drive", f"error about 0.4{DEGREE}")),
        ({"result": DONE, "problem": Refusal("speed-negative")}, ("Speed negative", "Check its source")),
    ],
)
def test_each_state_of_a_drive_has_its_lines(given, lines):
    assert shown(**given) == lines
