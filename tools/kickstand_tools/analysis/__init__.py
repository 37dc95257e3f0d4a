"""What a recorded ride says: channels of the vehicle, statistics, brake tests, pictures, other programs' files."""
