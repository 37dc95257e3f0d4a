"""The command `kickstand emulate`, which the entry point in pyproject.toml adds."""

import click
from kickstand_tools.cli.common import DISPLAY
from kickstand_tools.common.progress import spinner

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


def ready_emulator(chip: str) -> None:
    """Find the files that this chip's emulator needs. For the Pico, also compile the emulator.

    Call this function before importing the emulator. Raises InputError if a file or a package is missing.
    """
    from . import esp32_library, image, native

    if chip == "esp32":
        esp32_library.find()
        return
    with spinner(f"downloading {image.URL} into {image.path().parent}"):
        image.find()
    with spinner("compiling the emulator, once"):
        native.build()
