"""Programs for developers of Kickstand. These programs are only in a checkout, not in a wheel.

commands.py adds commands to `kickstand` by the entry points in pyproject.toml. soak.py tests the firmware for hours.
evaluation/ compares the firmware with other lean filters. pictures/ draws the pictures of the READMEs. reach.py finds
the tests of a change.
"""
