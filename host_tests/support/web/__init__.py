"""Tests of the pages in a browser: a simulated user, and fake ports and radios connected to boards in the test's
process."""
