"""A calibration computed from recorded poses (poses) or drives (drive), and its file (file)."""
