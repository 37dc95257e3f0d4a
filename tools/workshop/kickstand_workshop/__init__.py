"""What only developers of Kickstand run. It is in the checkout and in no wheel; commands.py adds to `kickstand` there,
by the entry points in pyproject.toml.

bench/ and soak/ measure and try the firmware, evaluation/ compares it with other filters, pictures/ draws the READMEs'
pictures, mutants/ judges the tests.
"""
