"""A config.py is a program and may end, hide or delay its own check. A config.py with such a fault is refused in one
line."""

import pytest
from kickstand_tools.deploy import config_check

_UNPRINTABLE = "class E:\n    def __repr__(self):\n        raise OSError\nSPEED = E()\n"
_UNEQUAL = "class E:\n    def __eq__(self, other):\n        raise OSError\nVEHICLE = E()\n"


@pytest.mark.parametrize(
    "text",
    [
        "import os\nos._exit(0)\n",
        "import os\nos._exit(3)\n",
        "raise SystemExit(3)\n",
        "raise KeyboardInterrupt\n",
        "raise GeneratorExit\n",
        "import atexit\natexit.register(lambda: print('more'))\n",
        "import atexit\natexit.register(lambda: print('[1, 2, 3]'))\n",
        "import sys\nsys.stdout.close()\n",
        "GPS_BAUD = 10**5000\n",
        _UNPRINTABLE,
        _UNEQUAL,
        "while True:\n    pass\n",
        "input()\n",
    ],
)
def test_config_that_escapes_its_check_is_refused_in_one_line(tmp_path, monkeypatch, text):
    monkeypatch.setattr(config_check, "LONGEST_S", 2)
    path = tmp_path / "config.py"
    path.write_text(text)
    fault = config_check.judge(path, "rp2", "Raspberry Pi Pico with RP2040").fault
    assert fault and fault.startswith(str(path)) and not fault.endswith(".")
    assert "\n" not in fault
