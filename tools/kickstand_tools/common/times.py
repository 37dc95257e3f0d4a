"""Formats times for a page or an axis."""


def clock(seconds: float) -> str:
    """Format a time as h:mm:ss or m:ss, such as 1:02:03 or 2:03."""
    rounded = round(seconds)
    hours, minutes = rounded // 3600, rounded // 60 % 60
    return f"{hours}:{minutes:02d}:{rounded % 60:02d}" if hours else f"{minutes}:{rounded % 60:02d}"


def tick_s(seconds: float) -> float:
    """Return a round interval in s between the ticks of a time axis. The axis then has 6 to 12 ticks."""
    return next((tick for tick in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800) if seconds < 12 * tick), 3600)
