"""Fetches recorded rides from a board, or streams a ride over USB, and converts the rides' blocks to logs."""
