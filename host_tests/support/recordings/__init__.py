"""Creates rides, logs and exports of apps for the tests: whole, random or broken."""
