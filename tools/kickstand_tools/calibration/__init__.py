"""A calibration computed from recorded poses (poses, six, two) or drives (drive), and its file (file)."""
