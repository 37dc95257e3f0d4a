"""Helpers that the tests share: they run boards, devices and programs, and read their output. Some helpers run on
MicroPython too."""
