"""Writes every picture to tools/pictures: .venv/bin/python -m kickstand_tools.pictures"""

from .. import firmware_path
from . import ride
from .drawn import drawn


def main() -> None:
    directory = firmware_path.TOOLS / "pictures"
    for name, svg in drawn().items():
        (directory / name).write_text(svg, encoding="utf-8")
    (directory / "ride.png").write_bytes(ride.draw())
    print(f"written: {directory}")


if __name__ == "__main__":
    main()
