"""How many blocks of a board's flash an update takes, as littlefs lays files out.

A file takes whole blocks, which are freed when it is removed, or when its replacement is closed. Each block after the
first begins with pointers of 4 bytes to blocks before it (littlefs, DESIGN.md, "CTZ skip-lists"). A small file may be
kept within its folder instead: up to an eighth of a block, less on some boards. A folder takes two blocks, and two more
when its entries outgrow them.
"""

from ..errors import InputError

FOLDER = 2
SPARE = 4  # a folder outgrows its two blocks; a block is written anew before the worn one is freed
_POINTER = 4


class NoRoom(InputError):
    """An update does not fit, even with all removed that it replaces."""


def most(size: int, block: int) -> int:
    """Blocks that a file of this many bytes may take."""
    count = 1
    while size > block * count - _POINTER * (2 * (count - 1) - (count - 1).bit_count()):
        count += 1
    return count


def least(size: int, block: int) -> int:
    """Blocks that are freed for certain when a file of this many bytes is removed."""
    return most(size, block) if size > block // 8 else 0
