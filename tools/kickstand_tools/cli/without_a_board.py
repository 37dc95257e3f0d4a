"""The commands that run the firmware without a board: demo, try, web."""

import contextlib
import sys
import webbrowser
from pathlib import Path
from typing import Any

import click
from kickstand_sim.demo.demo import DeviceStopped, demo

from ..common.output import check_directory
from ..common.progress import spinner
from ..web import serve, site
from .common import DISPLAY, PATH, echo, file_argument

_HAND = click.option("--hand", is_flag=True, help="Lean the bike and press the button yourself, on the keyboard.")
_CPYTHON = click.option("--cpython", is_flag=True, help="Run the firmware on CPython, not on MicroPython.")


@click.command()
@_HAND
@_CPYTHON
@DISPLAY
def demo_command(**chosen: Any) -> None:
    """Run the firmware on a simulated board, in the terminal.

    You see a press on the kickstand, a press upright, and a ride.
    """
    _demo(**chosen)


@click.command()
@file_argument("user", "FILE")
@_HAND
@_CPYTHON
@DISPLAY
def try_command(**chosen: Any) -> None:
    """Run your own code as user.py on the simulated board, during the demo's ride."""
    _demo(**chosen)


def _demo(**chosen: Any) -> None:
    try:
        demo(**chosen)
    except DeviceStopped as error:
        echo(str(error), err=True)
        sys.exit(1)


@click.command()
@click.option("--out", type=PATH, help="Write the site to this directory instead of opening it.")
def web_command(out: Path | None) -> None:
    """Open the simulated board and the other pages in the browser. With --out, write the site for any web server."""
    if out is not None:
        check_directory(out)
    with spinner("putting the site together"):
        files = site.site_files()
    if out is not None:
        site.write_site(files, out)
        echo(f"written: {out}, {len(files)} files for a web server; they do not work if opened directly")
        return
    with serve.server(files) as server:
        address = f"http://{serve.HOST}:{server.server_address[1]}/"
        echo(f"Kickstand in the browser: {address} (press Ctrl-C to stop)")
        webbrowser.open(address)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
