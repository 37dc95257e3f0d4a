"""Writes the pictures of the documents that show the firmware to tools/pictures:

    .venv/bin/python -m kickstand_workshop.pictures

The other drawings in this folder, such as the wiring, are their own sources.
"""

from kickstand_tools.common import installation

from . import displays, page, rides


def main() -> None:
    directory = installation.TOOLS / "pictures"
    for name, svg in (displays.draw() | {"demo.svg": displays.draw_demo()}).items():
        (directory / name).write_text(svg, encoding="utf-8")
    (directory / "ride.png").write_bytes(rides.ride_plot())
    (directory / "lean_compared.png").write_bytes(rides.lean_compared())
    if page.CHROMIUM:
        (directory / page.NAME).write_bytes(page.draw())
    else:
        print(f"no Chromium: {page.NAME} stays as it is")
    print(f"written: {directory}")


if __name__ == "__main__":
    main()
