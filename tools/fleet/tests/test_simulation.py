"""A simulated fleet has the documented faults, and its sensors measure what the equations of its roads say."""

import numpy as np
import pytest
from fleet_drives import TROUBLES
from kickstand_fleet import files
from kickstand_fleet.simulation.fleet import make_fleet
from kickstand_tools.common.messages import InputError
from support import command


def test_a_fleet_has_its_manifest_and_its_truth(fleet, periods):
    assert [vehicle.trouble for vehicle in fleet.vehicles] == TROUBLES
    assert [vehicle.name for vehicle in fleet.vehicles[:4]] == ["car-0000", "bus-0001", "motorcycle-0002", "car-0003"]
    for vehicle, period in zip(fleet.vehicles, periods, strict=True):
        assert period.paths == tuple(str(path) for path in vehicle.paths) and 1 <= len(vehicle.paths) <= 3
        assert period.kind == ("motorcycle" if vehicle.kind == "motorcycle" else "car")
        truth, turn = fleet.truth[vehicle.name], vehicle.mounts[-1] @ vehicle.mounts[0].T
        assert fleet.mount(vehicle.name) == pytest.approx(vehicle.mounts[-1], abs=1e-6)
        angle = np.degrees(np.arccos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0)))
        assert vehicle.moved_deg == pytest.approx(angle, abs=1e-4) == pytest.approx(float(truth["moved_deg"]), abs=1e-3)
        moved = {"moved-between": vehicle.moved_log or 0, "moved-within": 0}.get(vehicle.trouble, "")
        assert truth["moved_log"] == str(moved) and bool(truth["moved_s"]) == (vehicle.trouble == "moved-within")
        assert (vehicle.moved_deg >= 5.0) == vehicle.trouble.startswith("moved")


def test_a_seed_gives_the_same_fleet_by_command_and_function(tmp_path):
    for name, seed in (("one", 1), ("same", 1), ("other", 2)):
        result = command.works("simulate", "--fleet", 2, "--seed", seed, "--out", tmp_path / name)
    assert "2 vehicles, " in result.out
    first, repeated, other = ((tmp_path / name / "TRUTH.csv").read_text() for name in ("one", "same", "other"))
    assert first == repeated != other
    for path in (tmp_path / "one" / "drives").iterdir():
        assert path.read_bytes() == (tmp_path / "same" / "drives" / path.name).read_bytes()
    log = files.open_log(str(tmp_path / "one" / "drives" / "car-0000-1.csv"))  # about four minutes at 50 Hz
    assert 190.0 < log.t_s[-1] < 340.0 and np.diff(log.t_s) == pytest.approx(0.02)
    assert "Missing option '--profile'" in command.run("simulate", "--out", tmp_path / "x").err


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "drives").write_text("")
    with pytest.raises(InputError, match="drives"):
        make_fleet(tmp_path, 1)
