"""Fetches recorded rides from a board, or streams them over USB, and converts their blocks to logs."""
