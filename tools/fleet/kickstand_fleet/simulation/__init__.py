"""Simulates a fleet with its manifest and its truth, to test `kickstand fleet`."""
