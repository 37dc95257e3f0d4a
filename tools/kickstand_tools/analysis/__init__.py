"""A recorded ride analysed: the vehicle's channels, statistics, brake tests, pictures, files for other programs."""
