"""The commands `kickstand emulate` and `bench`, which the entry points in pyproject.toml add."""

import click
from kickstand_tools.cli.common import DISPLAY, JSON, show, spinner

CHIP = click.option(
    "--chip",
    type=click.Choice(["rp2040", "esp32"]),
    default="rp2040",
    help="rp2040 is a Pico. esp32 needs QEMU's library: see tools/docs/simulation.md.",
)


@click.command()
@click.option("--port", type=click.IntRange(1024, 65535), default=2040, help="The TCP port of the board's console.")
@CHIP
@DISPLAY
def emulate_command(port: int, chip: str, display: str) -> None:
    """Start an emulated board that flash can deploy to.

    It is at socket://127.0.0.1:PORT, with sensor, display and button on a simulated bike.
    """
    click.echo("starting: the emulator is being loaded, then the board is switched on, which takes some seconds")
    ready_emulator(chip)
    from .emulate import emulate

    emulate(port, click.echo, chip, display)


@click.command()
@click.option("--seconds", type=click.IntRange(1, 600), default=10, help="Emulated time of each run.")
@CHIP
@JSON
def bench_command(seconds: int, chip: str, as_json: bool) -> None:
    """Measure what the firmware costs on an emulated board: time, memory, flash."""
    ready_emulator(chip)
    from .bench import bench, tables

    result = bench(seconds, chip)
    show(result if as_json else None, tables(result))


def ready_emulator(chip: str) -> None:
    """Find the files that this chip's emulator needs. For the Pico, also compile the emulator.

    Call this function before importing the emulator. Raises InputError if a file or a package is missing.
    """
    from . import image, native

    if chip == "esp32":
        image.find_esp32()
        return
    with spinner(f"downloading {image.URL} into {image.path().parent}"):
        image.find()
    with spinner("compiling the emulator, once"):
        native.build()
