"""The PageTurner presses the button until a page is shown. If the page never appears, the PageTurner reports it and
stops."""

import pytest
from support import device_plans
from support.page_turner import MOST_PRESSES, PageTurner


def test_it_presses_until_each_page_is_shown():
    turner = PageTurner()
    assert not turner.presses("lean")
    turner.turn_to("raw")
    turner.turn_to("lean")
    shown = [None, "lean", "maxima", "raw", "lean", "lean"]
    assert [turner.presses(view) for view in shown] == [False, True, True, True, False, False]
    turner.check()


def test_it_gives_up_and_says_what_was_shown():
    turner = PageTurner()
    turner.turn_to("own")
    presses = sum(turner.presses(view) for view in ["lean", "maxima"] * MOST_PRESSES)
    assert presses == MOST_PRESSES
    with pytest.raises(AssertionError, match="no view own after 20 presses, only: lean, maxima"):
        turner.check()


def test_a_run_ends_with_the_page_that_it_did_not_find(tmp_path):
    with pytest.raises(AssertionError, match="no view own after 6 presses, only: align, not_aligned"):
        device_plans.run("cpython", tmp_path, {"turn_to": [[4.0, "own"]], "until": 6.0})
