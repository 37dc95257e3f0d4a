"""Times as they are given to --from, --to and --offset."""

import click
import command
import pytest
from kickstand_tools.cli.common import TIME


@pytest.mark.parametrize(
    "text, seconds",
    [("60", 60.0), ("12.5", 12.5), ("-30", -30.0), ("1:00", 60.0), ("-1:30.5", -90.5), ("1:02:03", 3723.0)],
)
def test_seconds_minutes_and_hours(text, seconds):
    assert TIME.convert(text, None, None) == seconds


@pytest.mark.parametrize("text", ["", "early", "1:", ":30", "1:2:3:4", "1:-5", "1.5:00", "nan", "inf", "--5"])
def test_what_is_no_time_is_refused_and_says_how(text):
    with pytest.raises(click.UsageError, match="is no time: give seconds such as 60"):
        TIME.convert(text, None, None)


def test_a_ride_without_a_name_is_no_fault(tmp_path):
    command.refused(tmp_path, "smooth", "", "--out", tmp_path / "LEAN.csv", words="is a directory")


def test_a_fleet_is_not_made_up_over_a_ride_and_has_no_profile(tmp_path):
    (tmp_path / "RIDE.csv").write_text("a ride")
    (tmp_path / "fleet").mkdir()
    (tmp_path / "fleet" / "MANIFEST.csv").write_text("a fleet")
    command.refused(tmp_path, "simulate", "--fleet", 2, "--out", tmp_path, words="holds a ride")
    given = "simulate", "--profile", "street"
    command.refused(tmp_path, *given, "--out", tmp_path / "fleet", words="holds a fleet")
    out = "--fleet", 2, "--out", tmp_path / "new"
    command.refused(tmp_path, *given, *out, words="--profile is of a single ride")
    command.refused(tmp_path, "simulate", "--speed", *out, words="--speed is of a single ride")
