"""Measures the stops of a ride as in a brake test, and finds the standstill at the end of each stop."""
