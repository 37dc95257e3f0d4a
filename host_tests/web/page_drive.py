"""A rider at the board of the page Try, which runs as fast as possible. The current directory is the board's flash."""

import json

from kickstand_tools.web.device import PageDevice
from support.page_turner import PageTurner

SHORT, LONG = ("press", 0.15), ("press", 1.2)
STAND, UPRIGHT, RIDE = ("pose", "kickstand"), ("pose", "upright"), ("pose", 15.0)
ALIGN = [("wait", 1.5), SHORT, ("wait", 4), UPRIGHT, ("wait", 3), SHORT, ("wait", 4)]
RIDING = [*ALIGN, RIDE, ("wait", 12), ("lean", 30), ("wait", 6)]


class Drive:
    """A rider at the page's device. The records of each tick get the stage of the drive and the rider's own doings."""

    def __init__(self):
        self.device = PageDevice()
        self.now_s = 0.0
        self.state = {"powered": True, "plugged": True, "armed": False, "pose": "kickstand", "stage": 0}
        self.records = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.device.board.uninstall()

    def run(self, seconds):
        self.now_s += seconds
        self.device.run_to(self.now_s)
        for tick in json.loads(self.device.take()):
            cut = self.state["armed"] and not tick["powered"]
            self.state["armed"] = self.state["armed"] and tick["powered"]
            self.records.append({**self.state, **tick, "cut": cut})

    def press(self, seconds):
        self.device.order("button", True)
        self.run(seconds)
        self.device.order("button", False)
        self.run(0.4)

    def do(self, name, value):
        """Carry out an order of PageDevice.act(), or: wait or press for some seconds, turn to a view by presses."""
        if name in ("wait", "press"):
            return self.run(value) if name == "wait" else self.press(value)
        if name == "turn_to":
            turner = PageTurner()
            turner.turn_to(value)
            while turner.presses(self.device.state()["view"]):
                self.press(0.15)
            return turner.check()
        self.device.order(name, value)
        if name == "pose":
            self.state["pose"] = value if isinstance(value, str) else "ride"
        elif name not in ("lean", "button"):
            self.state[{"sensor": "plugged", "power": "powered", "cut_save": "armed"}[name]] = value
        return None
