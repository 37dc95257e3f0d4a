"""Alignment from an ordinary motorcycle ride, without poses: windows -> first guess -> least squares -> quality."""
