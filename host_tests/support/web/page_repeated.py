"""Runs the page's board, or the same board with the firmware's own loop, with the same orders. Runs on CPython and
MicroPython.

The script has one argument, "page" or "loop". It reads JSON from standard input:
    {"until_s": s, "orders": [[s, name, value], ...]}
It uses the current directory as the board's flash. Its last line is JSON:
    {"orders": the orders with the times at which they were carried out,
     "displays": [[s, content of the display from then on], ...]}
"""

import json
import sys

from kickstand_tools.web.device import PageDevice


def page(orders, until_s):
    """Run the page's loop as worker.mjs does, but with time slices of other lengths."""
    device = PageDevice()
    ticks, slice_s, now_s = [], 0.007, 0.0
    for at_s, name, value in orders:
        while now_s < at_s:
            slice_s = 0.007 if slice_s > 0.09 else slice_s + 0.011
            now_s = min(at_s, now_s + slice_s)
            device.run_to(now_s)
        ticks.append([device.order(name, value), name, value])
    device.run_to(until_s)
    return ticks, json.loads(device.take())


def loop(orders, until_s):
    """Run kickstand.start.main() with its own loop."""
    device = PageDevice()
    from kickstand.start import main

    board = device.board
    for at_s, name, value in orders:
        board.at(at_s, lambda name=name, value=value: device.act(name, value))
    stopped = False
    while board.clock.now_us < until_s * 1e6:
        if not device.powered:
            device.rest()
        elif stopped:
            device.powered = stopped = device.resume(device.rest) != "off"
        else:
            ended = board.run(lambda: main(closed_ms=0), until_s)
            device.powered, stopped = ended != "off", ended == "returned"
    return orders, json.loads(device.take())


if __name__ == "__main__":
    given = json.load(sys.stdin)
    orders, ticks = (page if sys.argv[1] == "page" else loop)(given["orders"], given["until_s"])
    displays = [[tick["t_s"], tick["display"]] for tick in ticks if "display" in tick]
    print("\n" + json.dumps({"orders": orders, "displays": displays}))
