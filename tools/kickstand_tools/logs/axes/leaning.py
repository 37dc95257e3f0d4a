"""Moved to signals/leaning.py."""

from ...signals.leaning import WINDOW_S, Leaning, averaged, leaned, leaning_of, unrest, without_drift

__all__ = ["WINDOW_S", "Leaning", "averaged", "leaned", "leaning_of", "unrest", "without_drift"]
