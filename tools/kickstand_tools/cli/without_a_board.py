"""The commands that run the firmware without a board: demo, try, web, emulate."""

import contextlib
import sys
import webbrowser
from pathlib import Path
from typing import Any

import click

from ..demo.demo import DeviceStopped, demo
from ..emulator import esp32_library, image, native
from ..output import check_directory
from ..progress import spinner
from ..web import serve, site
from .common import CHIP, PATH, echo, file_argument

_HAND = click.option("--hand", is_flag=True, help="Lean the bike and press the button yourself, with keys.")
_CPYTHON = click.option("--cpython", is_flag=True, help="Run the firmware on CPython, not on MicroPython.")
_DISPLAY = click.option(
    "--display", type=click.Choice(["lcd", "ssd1306", "sh1106"]), default="lcd", help="Which display it has."
)


@click.command()
@_HAND
@_CPYTHON
@_DISPLAY
def demo_command(**chosen: Any) -> None:
    """Watch the firmware on a simulated board: kickstand press, upright press, a ride."""
    _demo(**chosen)


@click.command()
@file_argument("user", "FILE")
@_HAND
@_CPYTHON
@_DISPLAY
def try_command(**chosen: Any) -> None:
    """Try your own code: FILE is the simulated board's user.py, in the demo's ride."""
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
    """Ride the simulated board in the browser; with --out write the site for any web server."""
    if out is not None:
        check_directory(out)
    with spinner("putting the site together"):
        files = site.site_files()
    if out is not None:
        site.write_site(files, out)
        echo(f"written: {out}, {len(files)} files for a web server: opened as files they do not run")
        return
    with serve.server(files) as server:
        address = f"http://{serve.HOST}:{server.server_address[1]}/"
        echo(f"Kickstand in the browser: {address} (Ctrl-C ends it)")
        webbrowser.open(address)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()


@click.command()
@click.option("--port", type=click.IntRange(1024, 65535), default=2040, help="On which mpremote finds it.")
@CHIP
@_DISPLAY
def emulate_command(port: int, chip: str, display: str) -> None:
    """An emulated board on socket://127.0.0.1:PORT, with sensor, display and button on a simulated bike."""
    click.echo("starting: the emulator is being loaded, then the board is switched on, which takes some seconds")
    ready_emulator(chip)
    from ..emulator.emulate import emulate

    emulate(port, click.echo, chip, display)


def ready_emulator(chip: str) -> None:
    """Find what this chip's emulator needs and nothing else; compile that of the Pico. Call it before importing the
    emulator. Raises InputError if something is missing."""
    if chip == "esp32":
        esp32_library.find()
        return
    with spinner(f"downloading {image.URL} into {image.path().parent}"):
        image.find()
    with spinner("compiling the emulator, once"):
        native.build()
