"""Generates rides, logs and app exports for the tests: valid, random or broken."""
