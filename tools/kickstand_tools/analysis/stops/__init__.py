"""Finds the stops of a ride as in a brake test, and the standstills in which they end."""
