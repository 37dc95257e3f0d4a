"""Class names are unique: no two classes in the product have the same name without a reason."""

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# a driver of the firmware and the model of the same part
PARTS = {"Button", "Gps", "Lcd", "Mpu6050", "Oled", "Radio", "Sensor", "Wheel"}
# Users write both names: api.Ride is a log with its calibration, script.Ride a list of segments
PUBLIC = {"Ride"}


def test_no_class_name_is_there_twice_without_a_reason():
    places = defaultdict(list)
    for folder in ("firmware", "tools"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef):
                    places[node.name].append(path.relative_to(ROOT).as_posix())
    twice = {name: found for name, found in places.items() if len(found) > 1}
    assert {name: found for name, found in twice.items() if name not in PARTS | PUBLIC} == {}
    assert {name: len(found) for name, found in twice.items()} == dict.fromkeys(PARTS | PUBLIC, 2)
