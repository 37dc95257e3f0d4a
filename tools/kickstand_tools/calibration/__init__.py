"""Computes a calibration from recorded poses (poses) or drives (drive), and reads and writes its file (file)."""
