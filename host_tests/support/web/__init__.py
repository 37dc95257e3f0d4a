"""Helpers to test the pages in a browser: a user who clicks, and ports and radios connected to boards in the test's
process."""
