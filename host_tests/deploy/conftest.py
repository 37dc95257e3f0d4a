"""Caches the checks of config.py for the tests in this folder. The tests flash boards hundreds of times, and each check
would start a process."""

import functools
from pathlib import Path

import pytest
from kickstand_tools.deploy import config_check


@pytest.fixture(autouse=True)
def judged_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check the same config.py for the same board only once."""
    monkeypatch.setattr(config_check, "judge", _judge_once)


_judge = config_check.judge


@functools.cache
def _judged_before(path: Path, _content: bytes, port: str, machine: str) -> config_check.Judged:
    return _judge(path, port, machine)


def _judge_once(path: Path, port: str, machine: str) -> config_check.Judged:
    return _judged_before(path, path.read_bytes(), port, machine)
