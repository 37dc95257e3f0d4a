"""The page Try can replace the display of its running board by a display of another type."""

import json

from support.mpy import run_mpy

_SCRIPT = """
import json
from kickstand_tools.web.device import PageDevice
device = PageDevice()
device.run_to(2.0)
device.take()
seen = []
for kind in ("ssd1306", "lcd", "sh1106"):
    device.run_to(device.order("display", kind) + 3.0)
    seen.append([tick["display"] for tick in json.loads(device.take()) if "display" in tick][-1])
print(json.dumps(seen))
"""


def test_each_display_shows_the_device(tmp_path):
    seen = json.loads(run_mpy(_SCRIPT, directory=tmp_path).splitlines()[-1])
    assert [len(display.get("pixels", [])) for display in seen] == [1024, 0, 1024]
    assert all(display["lit"] and display["text"][0].startswith("Raw") for display in seen)
