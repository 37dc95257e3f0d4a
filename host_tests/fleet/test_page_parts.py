"""The numbers and the longest lists of a fleet's page, and when results are written during a run."""

import re

import pytest
from kickstand_fleet import run
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import failed
from kickstand_fleet.show.page import Glance


def result(vehicle, quality_deg=0.5, status="aligned", **changed):
    found = failed(Period(vehicle, "", "car", ()), "unreadable", "x")
    found.alignment |= {"status": status, "reason": "", "driven_s": 60.0, "halves_deg": 0.1}
    found.alignment["quality_deg"] = quality_deg
    found.errors, found.moved, found.brake_tests = (
        changed.get(name, []) for name in ("errors", "moved", "brake_tests")
    )
    return found


def glance_of(results):
    glance = Glance()
    for one in results:
        glance.add(one)
    return glance


def test_the_least_certain_25_and_the_largest_200_moves_are_listed():
    moves = [{"turned_deg": float(k)} for k in range(150)]
    glance = glance_of(result(str(k), 0.01 * k, moved=moves if k < 2 else []) for k in range(40))
    assert [row["vehicle"] for row in glance.worst] == [str(k) for k in range(39, 14, -1)]
    assert len(glance.moved) == 200 and glance.moved[0][0]["turned_deg"] == 149.0 == glance.moved[1][0]["turned_deg"]
    assert glance.moved[-1][0]["turned_deg"] == 50.0 and (glance.moved_count, glance.moved_vehicles) == (300, 2)


def test_the_first_three_errors_are_named():
    errors = [{"log": f"{k}.csv", "message": "gone"} for k in range(2)]
    glance = glance_of(result(str(k), errors=errors) for k in range(3))
    assert glance.first_errors == [("0.csv", "gone"), ("1.csv", "gone"), ("0.csv", "gone")] and glance.errors == 6


def test_the_common_folder_of_names_is_left_out():
    assert glance_of(map(result, ["/a/b/1", "/a/b/2"])).below == "/a/b/"
    assert glance_of(map(result, ["/a/bc/1", "/a/bd/2"])).below == "/a/"
    assert glance_of(map(result, ["x", "y"])).below == "" and Glance().below is None


def vehicles(html):
    """Return the names in the table of vehicles."""
    return re.findall(r">\s*(v\d+)\s*<", html.partition("<h2>Vehicles</h2>")[2])


def test_the_tiles_count_results():
    stop = {"utc_s": None, "mfdd_mps2": 5.0}
    results = [result("v1", brake_tests=[stop, stop]), result("v2"), result("v3", status="refused")]
    html = glance_of([*results, result("v4", status="error")]).page(8)
    text = re.sub(r"<[^>]*>", " ", html)
    assert "aligned (50 %)" in text and "hours of driving" in text
    glance = glance_of(results)
    for driven_s, hours in ((9.94 * 3600.0, "9.9"), (9.96 * 3600.0, "10.0"), (10.6 * 3600.0, "11")):
        glance.driven_s = driven_s
        assert re.search(rf">{re.escape(hours)}<[^>]*>\s*(<[^>]*>)?\s*hours of driving", glance.page(3)), hours


def test_refused_vehicles_come_first():
    glance = glance_of([result("v1"), result("v2", status="refused"), result("v3")])
    assert vehicles(glance.page(3)) == ["v2", "v1", "v3"]


def test_the_table_ends_after_2000_vehicles():
    glance = glance_of(result(f"v{k}", status="refused" if k > 2006 else "aligned") for k in range(2010))
    assert vehicles(glance.page(2010)) == ["v2007", "v2008", "v2009", *(f"v{k}" for k in range(1997))]


def test_the_page_says_how_many_results_are_missing():
    glance = glance_of([result("v1"), result("v2")])
    assert "2 mounted sensors<" in re.sub(r"\s+", " ", glance.page(2)).replace(" </p>", "<")
    assert "2 of 3 mounted sensors so far" in re.sub(r"\s+", " ", glance.page(3))


@pytest.mark.parametrize(("at_s", "written"), [(14.9, 1), (15.1, 2)])
def test_results_are_written_during_a_run_every_15_seconds(tmp_path, monkeypatch, at_s, written):
    """The results are also written once at the end of the run."""
    times = iter([0.0, at_s, at_s, at_s, *[at_s] * 50])
    monkeypatch.setattr(run.time, "monotonic", lambda: next(times))
    count = []
    monkeypatch.setattr(run, "write_results", lambda directory, results, expected: count.append(expected) or Glance())

    def tasks(function, items, *_):
        yield 0, failed(items[0][0], "unreadable", "x"), "", ""

    monkeypatch.setattr(run, "run_tasks", tasks)
    found = run.run_fleet([Period("v", "", "car", ("none.csv",))], tmp_path)
    assert count == [1] * written and (found.vehicles, found.new, found.damaged) == (1, 1, 0)
