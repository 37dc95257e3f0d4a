"""The firmware tests an SD card before a ride is recorded to it."""

import contextlib
import io
import os
import types

from kickstand.errors import CardError
from kickstand.rides import flash_ring, ride_paths
from rings import CARD


def tried(root, monkeypatch, **failing):
    """Return the problem that the trial of a card finds. failing: {name of a function: error that it raises}."""
    from kickstand.rides import card_trial

    def raised(error):
        def call(*_):
            raise error

        return call

    if "mount" in failing:
        monkeypatch.setattr(ride_paths, "directory", raised(failing["mount"]))
    if "free" in failing:
        monkeypatch.setattr(flash_ring, "free_bytes", raised(failing["free"]))
    recorder = types.SimpleNamespace(problem=None, keeper=types.SimpleNamespace(refused=None))
    with contextlib.redirect_stdout(io.StringIO()) as said:
        card_trial.prepare(recorder, CARD)
    assert recorder.problem is recorder.keeper.refused
    assert said.getvalue().count("\n") == (recorder.problem is not None)
    return recorder.problem


def test_a_card_is_tested_before_it_is_needed(root, monkeypatch):
    assert tried(root, monkeypatch) is None
    assert os.listdir("card") == []  # the test file was removed


def test_any_error_in_the_trial_is_a_refusal_of_the_card(root, monkeypatch):
    refusal = CardError("no-driver")
    with monkeypatch.context() as patch:
        assert tried(root, patch, mount=refusal) is refusal
    for error in (OSError(5), ValueError("a driver's own"), MemoryError()):
        with monkeypatch.context() as patch:
            problem = tried(root, patch, free=error)
        assert isinstance(problem, CardError)
        assert problem.code == "no-card"
        assert problem.values == (str(error),)


def test_a_card_that_does_not_read_back_is_refused(root, monkeypatch):
    from kickstand.rides import card_trial

    class Wrong(io.BytesIO):
        def read(self, *_):
            return b"something"

    monkeypatch.setattr(card_trial, "open", lambda path, mode: Wrong(), raising=False)
    assert tried(root, monkeypatch).code == "no-card"
