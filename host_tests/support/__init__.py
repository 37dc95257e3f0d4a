"""Code that the tests share: boards, devices, helpers to run programs and read their output. Some modules also run on
MicroPython."""
