"""Rides, logs and exports of apps that the tests make: whole, random or broken."""
