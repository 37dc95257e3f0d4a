"""What `kickstand status` says about the simulated board that is installed. See earlier_names.py.

load: returns the Settings. A script may replace it.
"""

import contextlib
import io
import sys

from kickstand import facts
from kickstand.settings import load
from kickstand_tools.deploy import status

from support.earlier_names import STATUS


def report():
    """Print the report."""
    facts.load = sys.modules[STATUS].load
    text = io.StringIO()
    try:
        with contextlib.redirect_stdout(text):
            facts.report()
    finally:
        facts.load = load
    print(status.words(text.getvalue()))
