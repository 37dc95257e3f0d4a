"""The examples in the docstrings of kickstand_tools.api run, and its functions do what the module promises."""

import doctest
import functools
import gzip
import importlib
import inspect
import io
import pydoc
import re
import sys

import numpy as np
import pytest
from kickstand_sim.simulated_board import simulator
from kickstand_sim.simulation.files import simulate
from kickstand_tools import api
from kickstand_tools.calibration.refusals import SamePose
from support import command

FUNCTIONS = [name for name, public in vars(api).items() if inspect.isfunction(public)]


@pytest.fixture(scope="module")
def shared_rides():
    """Simulate the same ride only once for all examples."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(api, "simulate_ride", functools.cache(api.simulate_ride))
        yield


@pytest.mark.usefixtures("shared_rides")
@pytest.mark.parametrize("name", FUNCTIONS + ["Log", "Stretch", "CalibrationFile"])
def test_example_in_each_docstring_runs(name):
    public = getattr(api, name)
    module = sys.modules[public.__module__]
    names = vars(module) | vars(api) | {"np": np}
    found = doctest.DocTestFinder(recurse=False).find(public, name, module=module, globs=names)
    tests = [test for test in found if test.examples]
    assert tests, f"{name} has no example"
    for test in tests:
        assert doctest.DocTestRunner().run(test).failed == 0


def test_the_simulated_board_has_its_earlier_name_too():
    assert importlib.import_module("kickstand_tools.simulated_board.simulator") is simulator
    assert simulator.__spec__ and simulator.__spec__.name == simulator.__name__


def test_pydoc_lists_the_promised_functions():
    """Without __all__, pydoc would leave out the names that the module only imports."""
    page = pydoc.plain(pydoc.render_doc(api))
    for name in ("import_recording", "fit_ride", "open_ride", "export", "simulate_ride"):
        assert re.search(rf"^ +{name}(\(| = )", page, re.M), name
    assert "_simulation" not in api.__all__


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    """Return the folder of a simulated ride and its poses. The functions under test make the ride's calibration."""
    folder = tmp_path_factory.mktemp("ride")
    simulate("street", 1, folder, seconds=60.0, speed=True)
    six = api.fit_six_positions([folder / f"POSE_{k}.csv" for k in range(1, 8)])
    two = api.fit_two_positions(folder / "KICKSTAND.csv", folder / "UPRIGHT.csv", six.calibration)
    api.write_calibration(folder / "RIDE.cal.json", two.calibration)
    return folder


def test_nothing_is_printed(directory, capfd):
    calls = []
    log = directory / "RIDE.csv"
    calibration = api.read_calibration(directory / "RIDE.cal.json")
    api.replay(log, calibration, progress=lambda done, total: calls.append((done, total)))
    api.overview(api.open_ride(log), lambda done, total: calls.append((done, total)))
    with pytest.raises(api.RefusedInput, match="only 2 of 5 braking events"):
        api.fit_drive([log], calibration, progress=lambda done, total: calls.append((done, total)))
    assert tuple(capfd.readouterr()) == ("", "")
    assert [done == total for done, total in calls].count(True) == 3  # each of the three calls reports its end once


def test_any_source_gives_the_same_log(directory):
    content = (directory / "RIDE.csv").read_bytes()
    (directory / "packed.csv.gz").write_bytes(gzip.compress(content))
    want = api.read_log(directory / "RIDE.csv")
    with (directory / "RIDE.csv").open(encoding="ascii") as text:
        sources = [
            str(directory / "RIDE.csv"),
            directory / "packed.csv.gz",
            text,
            io.BytesIO(content),
            io.StringIO(content.decode()),
            want,
        ]
        for source in sources:
            log = api.read_log(source)
            for name, values in log.columns().items():
                assert np.array_equal(values, want.columns()[name], equal_nan=True), name
    assert want.accel_g.shape == want.gyro_dps.shape == (len(want.t_s), 3)


def test_stops_and_summary_of_arrays_match_the_report(directory):
    """The functions for arrays find the same stops and the same summary as the report of the file."""
    channels = api.vehicle_channels(api.read_log(directory / "RIDE.csv"), directory / "RIDE.cal.json")
    ride_overview = api.overview(api.open_ride(directory / "RIDE.csv"))
    assert ride_overview.stops == api.find_stops(channels) != []
    assert api.summary(channels).left_deg == ride_overview.summary.left_deg


def test_tables_are_data_frames(directory):
    pytest.importorskip("pandas")
    log = api.read_log(directory / "RIDE.csv")
    lean = api.replay(log, api.read_calibration(directory / "RIDE.cal.json"))
    for table in log, lean, api.vehicle_channels(log, directory / "RIDE.cal.json"):
        frame = table.to_pandas()
        assert len(frame) == len(log.t_s)
        assert frame.columns[0] == "t_s"


def test_without_pandas_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    log = api.Log(np.arange(2.0), np.zeros((2, 3)), np.zeros((2, 3)))
    with pytest.raises(api.InputError, match=r"data frames need pandas: .*\[rides\]"):
        log.to_pandas()


def test_a_refusal_has_its_code_and_fields(directory):
    pose = directory / "UPRIGHT.csv"
    with pytest.raises(api.RefusedInput) as raised:
        api.fit_two_positions(pose, api.read_log(pose))
    assert raised.value.code == "same-pose"
    assert isinstance(raised.value.message, SamePose)
    assert raised.value.message.apart_deg == pytest.approx(0.0, abs=0.1)
    assert str(raised.value).startswith(f"{pose} and {pose}: both poses are the same")


def test_an_open_file_with_a_mistake_is_refused_by_its_name(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(command.HEADER + "\n0,0,0,one,0,0,0\n")
    with path.open() as file, pytest.raises(api.InputError, match=r"log\.csv, line 2: az_g is 'one'"):
        api.read_log(file)
    with pytest.raises(api.InputError, match="the log, line 2: az_g"):
        api.read_log(io.StringIO(path.read_text()))


def test_the_events_of_a_refused_drive_are_reported(directory):
    events = []
    with pytest.raises(api.RefusedInput) as raised:
        api.fit_drive([directory / "RIDE.csv"], vehicle="car", on_event=events.append)
    assert raised.value.code
    assert events[0].what == "log-begins"
