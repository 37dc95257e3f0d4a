"""Copies the firmware to a board, and queries a board, with mpremote."""
