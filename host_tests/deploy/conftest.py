"""A board is flashed by the hundred here, and its config.py is judged each time by a process of its own."""

import functools
from pathlib import Path

import pytest
from kickstand_tools.deploy import config_check


@pytest.fixture(autouse=True)
def judged_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same config.py for the same board is judged once."""
    monkeypatch.setattr(config_check, "judge", _judge_once)


_judge = config_check.judge


@functools.cache
def _judged_before(path: Path, _content: bytes, port: str, machine: str) -> config_check.Judged:
    return _judge(path, port, machine)


def _judge_once(path: Path, port: str, machine: str) -> config_check.Judged:
    return _judged_before(path, path.read_bytes(), port, machine)
