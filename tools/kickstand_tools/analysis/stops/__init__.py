"""Stops of a ride as a brake test has them, and the standstills they end in."""
