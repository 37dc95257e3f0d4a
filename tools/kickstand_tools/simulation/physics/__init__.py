"""The physics of a simulated ride, with numpy: bike, balance, road, engine and the sensor on it.

../ride.py puts them together.
"""
