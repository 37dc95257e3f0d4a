"""Uses the page Rides in a browser, and compares numbers."""

from pathlib import Path

import numpy as np
import pytest

from support.recordings import analysis_rides, app_exports

WAIT_MS = 120_000  # Python starts slowly on a busy computer
PHONE_MOUNTED = analysis_rides.CALIBRATION | {"vehicle_from_sensor": app_exports.PHONE.tolist()}


class Rides:
    """Uses the page Rides in a browser: chooses files, and returns the page's texts."""

    def __init__(self, rider):
        self.rider, self.page = rider, rider.page
        self.given = set()  # paths of the files chosen last

    def give(self, *files):
        """Replace all files by these. Return the page's final message."""
        while self.held():
            self.remove("#held li:first-child button")
            self.said()
        self.given = set()
        return self.add(*files)

    def show(self, *files):
        """Choose these files, unless their report is already shown."""
        is_listed = self.given == set(files) and set(self.held()) == {file.name for file in files}
        if not is_listed or self.page.is_hidden("#report"):
            assert self.give(*files) == ""

    def add(self, *files):
        """Add files. Return the page's final message."""
        self.page.set_input_files("#files", files)
        self.given.update(files)
        return self.said()

    def remove(self, button):
        """Press a button in the list of the files."""
        self.page.eval_on_selector("#held", "list => (list.open = true)")
        self.page.click(button)

    def held(self):
        """Return {name of a chosen file: the page's text about it}."""
        cells = "rows => rows.map((row) => [row.children[0].textContent, row.children[1].textContent])"
        return dict(self.page.eval_on_selector_all("#held li", cells))

    def said(self):
        self.page.wait_for_function("document.querySelector('#work').hidden", timeout=WAIT_MS)
        return self.page.inner_text("#said")

    def saved(self, selector) -> bytes:
        """Return the content of the file that a button offers for download."""
        with self.page.expect_download(timeout=WAIT_MS) as download:
            self.page.click(selector)
        return Path(download.value.path()).read_bytes()

    def report(self):
        """Return the rows of the report as the page shows them."""
        return self.page.eval_on_selector_all(
            ":is(#report, #more) tbody tr",
            "rows => rows.map((row) => [...row.cells].map((cell) => cell.textContent.trim()))",
        )

    def warnings(self):
        return self.page.inner_text("#warnings")


def near(found, wanted, by):
    found, wanted = (np.array(values, dtype=float) for values in (found, wanted))
    return found.shape == wanted.shape and np.allclose(found, wanted, rtol=1e-6, atol=by, equal_nan=True)


def assert_near(found, wanted):
    """Assert that both JSON values are equal, except for the last digit of their numbers."""
    if isinstance(wanted, dict):
        assert found.keys() == wanted.keys()
        for key in wanted:
            assert_near(found[key], wanted[key])
    elif isinstance(wanted, list):
        for actual, other in zip(found, wanted, strict=True):
            assert_near(actual, other)
    else:
        assert found == (pytest.approx(wanted, abs=0.0021) if type(wanted) is float else wanted)
