"""Shows a refusal or a fault on the display, in two lines of 16 characters."""

DEGREE = "\xdf"  # code of the degree sign in the display's character ROM

# The words that are shown instead of the lean. The keys are values of LeanMeter.suppressed_reason while the alignment
# is in doubt, and of LeanMeter.odd.
NO_LEAN = {
    "other-side": "side was wrong?",
    "mount-moved": "mount has moved",
    "odd-left": "sensor odd: left",
    "odd-up": "sensor odd: up",
    "odd-pitch": "sensor odd: tilt",
}
_OTHER_SETTING = "config.py: wrong|{0}"  # {0} is the setting's name; the console says what is wrong with its value


def lines(refusal):
    """Return the two lines for a Refusal or a Notice, neither padded nor cut. A code without a row in words.py belongs
    to a wrong setting."""
    if refusal.code == "starting":  # shown at each start
        return "Kickstand", "starting"
    try:
        from .words import LINES  # imported only for a fault, because it takes 4 KB of heap
    except (ImportError, MemoryError):
        return refusal.code, "see USB console"
    return tuple(refusal.words(LINES, _OTHER_SETTING).split("|"))
