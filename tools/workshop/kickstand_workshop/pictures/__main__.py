"""Writes every picture to tools/pictures: .venv/bin/python -m kickstand_workshop.pictures"""

from kickstand_tools.common import firmware_path

from ..browser import CHROMIUM
from . import explained, page, ride
from .drawn import drawn


def main() -> None:
    directory = firmware_path.TOOLS / "pictures"
    for name, svg in drawn().items():
        (directory / name).write_text(svg, encoding="utf-8")
    (directory / "ride.png").write_bytes(ride.draw())
    (directory / "lean_compared.png").write_bytes(explained.lean_compared())
    if CHROMIUM:
        (directory / page.NAME).write_bytes(page.draw())
    else:
        print(f"no Chromium: {page.NAME} stays as it is")
    print(f"written: {directory}")


if __name__ == "__main__":
    main()
