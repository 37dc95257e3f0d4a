"""The limits of a match and of two clocks, each with values on both sides of it."""

import datetime as dt
from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining import agreement, clocks, fit, match, track_files
from kickstand_tools.joining.clocks import Clocks
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.joining.track import Track

STEP_S = 0.05


def moved(rates, up=(0.0, 1.0, 0.0)) -> CellMotion:
    rates = np.array(rates, dtype=float)
    return CellMotion(np.tile(np.array(up), (len(rates), 1)), rates, np.ones(len(rates), dtype=bool), False, False)


# match.py


def found_fit(shift_s=10.0, evidence=50.0, **others) -> fit.TrackFit:
    given = {"drift": 0.0, "sigma_s": 0.1, "correlation": 0.95, "tilt": np.zeros(2), "segments": 4} | others
    return fit.TrackFit(shift_s=shift_s, evidence=evidence, **given)


@pytest.fixture
def matched(monkeypatch):
    """Return a function that returns the Match, or the refusal, of a track for given fits."""
    track = Track(1000.0 + np.arange(100.0), np.zeros(100), np.arange(100.0) * 1e-4, np.full(100, 9.0), "t")
    motion = moved(np.zeros((1600, 3)))

    def result(*fits, mirrored=False, apart=0.0):
        monkeypatch.setattr(match, "_check_turns", lambda *_: None)
        monkeypatch.setattr(match, "_rough_shifts", lambda *_: (mirrored, list(range(len(fits)))))
        monkeypatch.setattr(match, "fitted", lambda *given: fits[given[3]])
        monkeypatch.setattr(match, "cost_of_one_shift", lambda *_: apart)
        try:
            return match.match(motion, track)
        except InputError as error:
            return str(error)

    return result


def test_a_match_by_hand(matched):
    """The ride lasts 80 s, the track 99 s. If the ride begins at 10 s of the track, 80 s are in common. If the ride
    begins at 40 s, 59 s are in common."""
    found = matched(None, found_fit(), found_fit(30.0, 43.9))
    assert (found.start_utc_s, found.drift, found.sigma_s, found.correlation) == (1010.0, 0.0, 0.1, 0.95)
    assert found.common_s == pytest.approx(80.0)
    assert matched(found_fit(40.0)).common_s == pytest.approx(59.0)
    assert matched(found_fit(-5.0)).common_s == pytest.approx(75.0)


def test_the_evidence_and_correlation_that_a_match_needs(matched):
    few = "they have 120 s with too few bends in common"
    assert matched(found_fit(evidence=15.0, correlation=0.6)).correlation == 0.6
    assert matched(found_fit(evidence=14.9)).startswith(few)
    assert matched(found_fit(evidence=14.9, correlation=0.9)).startswith("at no time does the ride turn like")
    assert matched(found_fit(correlation=0.59)).startswith("at no time does the ride turn like")
    assert matched(found_fit(evidence=14.9), mirrored=True).startswith("the ride turns left where the track turns r")
    assert matched(found_fit(), mirrored=True).start_utc_s == 1010.0
    assert matched(None).startswith("they have less than 60 s of riding in common")


def test_another_shift_needs_six_less_evidence(matched):
    assert matched(found_fit(40.0, 44.1), found_fit()).startswith("the track fits at two times, 30 s apart")
    assert matched(found_fit(40.0, 44.0), found_fit()).start_utc_s == 1010.0
    # A fit 6 s away still counts as the same shift
    assert matched(found_fit(16.0, 49.0), found_fit()).start_utc_s == 1010.0
    assert matched(found_fit(3.9, 49.0), found_fit()).startswith("the track fits at two times, 6 s apart")


def test_a_drift_or_another_pace_is_another_day(matched):
    assert matched(found_fit(drift=-400e-6), apart=3.0).drift == -400e-6
    for refused in (matched(found_fit(drift=-401e-6)), matched(found_fit(), apart=3.1)):
        assert refused.startswith("the ride turns like the track, but at other times")
    assert matched(found_fit(sigma_s=0.3)).sigma_s == 0.3
    assert matched(found_fit(sigma_s=0.31)).startswith("the track fits only to 0.3 s, not to 0.3 s")


def test_rough_shifts_need_a_tenth_of_the_best_evidence(monkeypatch):
    """The likelihoods are 20 at the shift 10 s and 1.9 or 2.1 at the shift 30 s. The second shift is tried only if its
    likelihood is at least 2. The ride has 100 values, so index 119 is the shift 10 s."""
    known = np.ones(200, dtype=bool)
    for other, tried in ((1.9, [10.0]), (2.1, [10.0, 30.0])):
        found = np.zeros(299)
        found[119], found[159] = 20.0, other
        monkeypatch.setattr(match, "_changes_of_track", lambda *_: (np.zeros(200), known))
        monkeypatch.setattr(match, "_changes_of_ride", lambda *_: (np.zeros(100), known[:100]))
        monkeypatch.setattr(match, "correlations", lambda *_, found=found: (found, np.full(299, 60)))
        monkeypatch.setattr(match, "log_likelihood_ratio", lambda values, *_: np.maximum(values, 0.0))
        assert match._rough_shifts(None, None) == (False, tried)  # type: ignore[arg-type]
        monkeypatch.setattr(match, "correlations", lambda *_, found=found: (found, np.full(299, 59)))
        assert match._rough_shifts(None, None) == (False, [])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("likely", "opposite", "mirrored"), [(7.0, 15.1, True), (7.0, 14.9, False), (9.0, 17.9, False), (9.0, 18.1, True)]
)
def test_a_mirrored_ride_fits_twice_as_well(monkeypatch, likely, opposite, mirrored):
    known = np.ones(200, dtype=bool)
    found = np.zeros(299)
    found[119], found[159] = likely, -opposite
    monkeypatch.setattr(match, "_changes_of_track", lambda *_: (np.zeros(200), known))
    monkeypatch.setattr(match, "_changes_of_ride", lambda *_: (np.zeros(100), known[:100]))
    monkeypatch.setattr(match, "correlations", lambda *_: (found, np.full(299, 60)))
    monkeypatch.setattr(match, "log_likelihood_ratio", lambda values, *_: np.maximum(values, 0.0))
    assert match._rough_shifts(None, None)[0] is mirrored  # type: ignore[arg-type]


# clocks.py


PLAIN = CalibrationFile(vehicle_from_sensor=np.eye(3), aligned=True)


@pytest.fixture
def clocked(monkeypatch):
    """Return a function that returns the shift that is fitted, or the refusal.

    The first sensor has 2000 cells and the second 1600. tried: (place, correlation, evidence) of each rough shift.
    """

    def result(*tried):
        by_shift = {round((place - 1599) * STEP_S, 6): (alike, ratio) for place, alike, ratio in tried}
        ratios = {alike: ratio for _, alike, ratio in tried}
        monkeypatch.setattr(clocks, "peaks", lambda *_: [place for place, _, _ in tried])
        monkeypatch.setattr(clocks, "_correlation_at", lambda *given: by_shift[round(given[4], 6)][0])
        monkeypatch.setattr(
            clocks, "log_likelihood_ratio",
            lambda values, *_: np.array(ratios[float(values)]) if values.ndim == 0 else values,
        )  # fmt: skip
        monkeypatch.setattr(clocks, "_rotation", lambda *_: np.eye(3))
        monkeypatch.setattr(clocks, "_fitted", lambda *given: Clocks(given[4], 0.0, 0.9, 80.0))
        rates = np.random.default_rng(1).normal(0.0, 5.0, (2000, 3))
        try:
            return round(clocks.clocks(moved(rates), moved(rates[:1600]), PLAIN, PLAIN).later_s, 6)
        except InputError as error:
            return str(error)

    return result


def test_the_best_rough_shift_is_fitted(clocked):
    assert clocked((1599, 0.9, 20.0)) == 0.0
    assert clocked((1699, 0.91, 40.0), (1599, 0.9, 20.0)) == 5.0
    assert clocked((1699, 0.9, 34.0), (1599, 0.91, 40.0)) == 0.0
    assert clocked((1699, 0.9, 34.1), (1599, 0.91, 40.0)).startswith("they fit at two times")


def test_two_logs_need_evidence_and_correlation(clocked):
    assert clocked((1599, 0.8, 15.0)) == 0.0
    for refused in (clocked((1599, 0.79, 20.0)), clocked((1599, 0.9, 14.9)), clocked()):
        assert refused.startswith("at no time do they turn alike for a minute")


def test_a_correlation_of_rates_by_hand():
    """Without their means, the two axes have the values -1.5, -0.5, 0.5, 1.5 and -1, 1, 3, -3. The sum of the products
    is -2, and the sums of the squares are 5 and 20."""
    a = moved(np.zeros((4, 3)))
    one, other = np.array([[1.0], [2.0], [3.0], [4.0]]), np.array([[2.0], [4.0], [6.0], [0.0]])
    product = -1.5 * -1.0 + -0.5 * 1.0 + 0.5 * 3.0 + 1.5 * -3.0
    assert clocks._correlation_at(a, a, one, other, 0.0) == pytest.approx(product / np.sqrt(5.0 * 20.0))
    assert clocks._correlation_at(a, a, one, one[::-1], 0.0) == pytest.approx(-1.0)
    later = clocks._correlation_at(a, moved(np.zeros((3, 3))), one, one[1:], STEP_S)
    assert later == pytest.approx(1.0)


def test_clocks_use_a_sum_and_an_interpolation_by_hand():
    p, q = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[1.0, 1.0], [2.0, -1.0]])
    assert clocks._dot(p, q, np.array([1.0, 10.0])) == pytest.approx(3.0 + 20.0)
    between = clocks._interpolated_at(np.array([0.0, 1.0]), np.array([[0.0, 5.0], [2.0, 9.0]]), np.array([0.25]))
    assert between == pytest.approx(np.array([[0.5, 6.0]]))


def test_a_fit_of_clocks_finds_a_shift_of_eight_cells():
    """The search begins at a shift of 0, and finds the shift of 0.4 s. The rates of B have an error of 0.5 deg/s."""
    at_s = np.arange(3000) * STEP_S
    rates = np.column_stack([20.0 * np.sin(at_s * rate + rate) for rate in (0.7, 0.9, 1.3)])
    late = np.column_stack([20.0 * np.sin((at_s + 0.4) * rate + rate) for rate in (0.7, 0.9, 1.3)])
    late += np.random.default_rng(1).normal(0.0, 0.5, late.shape)
    found = clocks._fitted(moved(rates), moved(late), rates, late, 0.0)
    assert found.later_s == pytest.approx(0.4, abs=5e-3)
    assert found.drift == pytest.approx(0.0, abs=5e-5)
    assert found.common_s == pytest.approx(150.0 - 0.4, abs=0.06)


# agreement.py


def test_leans_are_compared_above_3_mps_only(monkeypatch):
    """Two logs of 100 s, of which the second begins 1 s later. The bike rides at 3.0 m/s until 40 s, and faster until
    90 s."""
    t_s = np.arange(0.0, 100.0, 0.1)
    ride = SimpleNamespace(
        t_s=t_s, lean_deg=np.zeros(1000), lean_sigma_deg=np.ones(1000), notices=[],
        speed_mps=np.where((t_s > 40.0) & (t_s < 90.0), 3.1, 3.0),
    )  # fmt: skip
    monkeypatch.setattr(agreement, "read_twice", lambda source: source)
    monkeypatch.setattr(agreement, "motion", lambda *_: None)
    monkeypatch.setattr(agreement, "clocks", lambda *_: Clocks(1.0, 0.0, 0.9, 99.0))
    monkeypatch.setattr(agreement, "smooth", lambda *_: ride)
    monkeypatch.setattr(agreement, "replay", lambda *_: ride)
    found = agreement.compare_rides("a", "b", PLAIN, PLAIN)
    assert found.t_s[:2] == pytest.approx([0.0, 0.02]) and found.t_s[-1] == pytest.approx(99.88)
    assert found.smoothed.seconds == pytest.approx(49.0, abs=0.3)
    riding = found.t_s[np.isfinite(found.leans["smoothed B"])]
    assert riding[0] == pytest.approx(41.0, abs=0.11) and riding[-1] == pytest.approx(90.0, abs=0.11)
    ride.speed_mps = np.where((t_s > 40.0) & (t_s < 60.0), 3.1, 3.0)
    with pytest.raises(InputError, match="a, b: under 20 s of riding in common"):
        agreement.compare_rides("a", "b", PLAIN, PLAIN)


def test_a_lean_is_unknown_between_samples_200_ms_apart():
    for gap_s, known in ((0.19, True), (0.21, False)):
        found = agreement._interpolated(np.array([0.0, gap_s]), np.array([1.0, 1.0]), np.array([0.05]))
        assert np.isfinite(found[0]) == known


def test_a_picture_shows_both_leans_and_their_difference(monkeypatch, tmp_path):
    """matplotlib would show text between two dollar signs as a formula, so names are not parsed."""
    from matplotlib.figure import Figure

    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, dpi: drawn.append((figure, path, dpi)))
    names = ("live A", "live B", "smoothed A", "smoothed B")
    leans = {name: np.full(3, value) for name, value in zip(names, (1.0, 3.0, 10.0, 17.0))}
    same = agreement.Difference(90.0, 2.0, 1.5, 1.0, 1.9, 3.0, 1.03, 0.04, 1.2, 0.5, 0.9)
    found = agreement.Agreement(
        Clocks(0.0, 0.0, 0.9, 9.0), None, same, np.array([0.0, 60.0, 120.0]), leans, {}, ("x/A.csv", "B.csv")
    )
    agreement.draw(tmp_path / "c.png", found)
    figure, path, _ = drawn[0]
    assert path == tmp_path / "c.png"
    above, below = figure.axes
    lines = [(line.get_label(), line.get_ydata()[0]) for line in (*above.lines, *below.lines)]
    assert lines == [
        ("smoothed A: A.csv", 10.0), ("smoothed B: B.csv", 17.0), ("live, B less A", 2.0),
        ("smoothed, B less A", 7.0),
    ]  # fmt: skip
    assert above.get_xlim() == (0.0, 120.0) and below.xaxis.get_major_formatter()(60.0, 0) == "1:00"
    assert not any(text.get_parse_math() for axis in figure.axes for text in axis.get_legend().get_texts())


# track_files.py


def test_a_time_without_a_zone_is_universal():
    """Both formats of tracks write Universal Time. One day has 86,400 s."""
    day = dt.datetime(1970, 1, 2)
    assert track_files._utc_s(day) == track_files._utc_s(day.replace(tzinfo=dt.UTC)) == 86_400.0
    assert track_files._utc_s(day.replace(tzinfo=dt.timezone(dt.timedelta(hours=2)))) == 79_200.0


def test_a_gpx_speed_is_its_own_or_an_extensions():
    def extension(tag, text):
        return SimpleNamespace(iter=lambda: [SimpleNamespace(tag=tag, text=text)])

    def speed(own, *extensions):
        return track_files._gpx_speed(SimpleNamespace(speed=own, extensions=extensions))

    assert speed(3, extension("speed", "4")) == 3.0
    assert speed(None, extension("{x}hr", "90"), extension("{x}Speed", "4")) == 4.0
    for nothing in ((), (extension("speed", "x"),), (extension("speed", ""),), (extension(None, "4"),)):
        assert np.isnan(speed(None, *nothing))
