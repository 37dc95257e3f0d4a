"""Kickstand without a board: the simulated board, simulated rides, and the demo."""
