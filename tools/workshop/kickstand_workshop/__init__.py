"""Programs for developers of Kickstand. These programs are only in a checkout, not in a wheel.

commands.py adds commands to `kickstand` by the entry points in pyproject.toml. bench/ measures what the firmware costs,
and soak/ tests the firmware for hours. evaluation/ compares the firmware with other lean filters. pictures/ draws the
pictures of the READMEs.
"""
