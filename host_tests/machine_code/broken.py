"""One mistake in each viper function, as a compiler might make it."""

from pathlib import Path

from kickstand_tools import firmware_path

# (module, function): what of its source is replaced by what
MISTAKES = {
    ("imu/fifo_frames_viper.py", "decode"): ("frames[at] << 8 |", "frames[at] << 8 &"),
    ("imu/fifo_frames_viper.py", "add_up"): ("value > 32767", "value > 32768"),
    ("calibration/transform_viper.py", "products"): ("matrices[at + 2] * z", "matrices[at + 2] * (z & 0x1FFFF)"),
    ("rides/block_viper.py", "encode"): ("guess * n // before", "guess // before * n"),
}


def write(path: str, name: str, target: Path) -> None:
    """The module with its mistake in that function."""
    source = (firmware_path.PACKAGE / path).read_text(encoding="utf-8")
    right, wrong = MISTAKES[path, name]
    start = source.index(f"def {name}(")
    assert right in source[start:]
    target.write_text(source[:start] + source[start:].replace(right, wrong, 1), encoding="utf-8")
