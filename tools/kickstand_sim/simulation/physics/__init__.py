"""Simulates the physics of a ride with numpy: bike, balance, road, engine and sensor. ../ride.py combines them."""
