"""Programs for developers of Kickstand. They are only in a checkout, not in a wheel. commands.py adds commands to
`kickstand` by the entry points in pyproject.toml.

bench/ and soak/ measure and test the firmware, evaluation/ compares it with other filters, pictures/ draws the READMEs'
pictures, mutants/ judges the tests.
"""
