"""The physics of a simulated ride, with numpy: bike, balance, road, engine and sensor.

../ride.py combines them.
"""
