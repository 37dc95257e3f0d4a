"""Reads, checks, writes and cuts recorded logs. Corrects uneven times and marks frozen readings."""
