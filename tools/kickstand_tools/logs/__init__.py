"""Reads, checks, writes and cuts recorded logs; corrects uneven times and marks frozen readings."""
