"""Unreadable logs are refused in one line. Logs that differ only in format are read."""

import gzip

import pytest
from support import command

ROW = "0.00,0,0,1,0,0,0"
GOOD = [f"{k / 100:.2f},0.01,-0.02,1.01,0.5,-0.5,0.1" for k in range(20)]


def text(*rows, header=command.HEADER):
    return ("\n".join([header, *rows]) + "\n").encode()


BAD = {
    "empty.csv": (b"", "is empty"),
    "blank.csv": (b" \n\n", "is empty"),
    "header only.csv": (text(), "too short"),
    "one sample.csv": (text(ROW), "too short"),
    "no header.csv": (b"\n".join(g.encode() for g in GOOD), "line 1: no column t_s"),
    "no gz.csv": (text(*GOOD, header=command.HEADER.replace(",gz_dps", "")), "line 1: no column gz_dps"),
    "column twice.csv": (text(*GOOD, header=command.HEADER + ",ax_g"), "line 1: column ax_g exists twice"),
    "word.csv": (text(*GOOD[:3], "0.03,0,0,one,0,0,0"), "line 5: az_g is 'one', not a number"),
    "underscore.csv": (text(*GOOD[:3], "0.03,0,0,1_0,0,0,0"), "line 5: az_g is '1_0', not a number"),
    "empty cell.csv": (text(*GOOD[:3], "0.03,0,,1,0,0,0"), "line 5: ay_g is empty"),
    "nan.csv": (text(*GOOD[:3], "0.03,0,nan,1,0,0,0"), "line 5: ay_g is 'nan'"),
    "inf.csv": (text(*GOOD[:3], "0.03,0,0,1,0,-inf,0"), "line 5: gy_dps is '-inf'"),
    "huge.csv": (text(*GOOD[:3], "0.03,0,0,1,0,1e999,0"), "line 5: gy_dps is '1e999'"),
    "m per s2.csv": (text(*GOOD[:3], "0.03,0,0,98.1,0,0,0"), "line 5: az_g is '98.1', past any reading"),
    "counts.csv": (text(*GOOD[:3], "0.03,0,0,16384,0,0,0"), "its unit is g"),
    "time nan.csv": (text(*GOOD[:3], "nan,0,0,1,0,0,0"), "line 5: t_s is 'nan'"),
    "time stands.csv": (text(*["7.0" + g[4:] for g in GOOD]), "the time is the same in all samples"),
    "time goes back.csv": (text(*GOOD[:3], GOOD[0]), "line 5: time goes back from 0.020000 at 0.00 s"),
    "short row.csv": (text(*GOOD[:3], "0.03,0,0", GOOD[4]), "line 5: 3 values under 7 column names"),
    "long row.csv": (text(*GOOD[:3], GOOD[3] + ",1"), "line 5: 8 values under 7 column names"),
    "speed word.csv": (text(ROW + ",fast", header=command.HEADER + ",speed_mps"), "line 2: speed_mps is 'fast'"),
    "semicolons.csv": (text(ROW).replace(b",", b";"), "commas"),
    "open quote.csv": (text(*GOOD[:3], '0.03,"0,0,1,0,0,0', *GOOD[4:]), "column names: is the line cut?"),
    "binary.csv": (bytes(range(256)), "line 2: not text"),
    "zeros.csv": (bytes(100), "is empty"),
    "utf-16.csv": (text(*GOOD).decode().encode("utf-16"), "line 1: not text"),
    "gzip without its name.csv": (gzip.compress(text(*GOOD)), "not text"),
    "not gzip.csv.gz": (text(*GOOD), "is not a gzip file"),
    "empty.csv.gz": (b"", "is empty"),
    "nothing inside.csv.gz": (gzip.compress(b""), "is empty"),
    "cut.csv.gz": (gzip.compress(text(*GOOD))[:12], "cut short"),
    "changed.csv.gz": (gzip.compress(text(*GOOD))[:-8] + bytes(8), "is damaged: copy it again"),
    "damaged.csv.gz": (gzip.compress(text(*GOOD))[:20] + b"\xff" * 60, "damaged"),
    "binary inside.csv.gz": (gzip.compress(bytes(range(256))), "not text"),
    "line\nbreak.csv": (b"", "is empty"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_log_is_refused(tmp_path, name):
    content, words = BAD[name]
    log = tmp_path / name
    log.write_bytes(content)
    cal = command.write_cal(tmp_path / "CAL.json")
    (tmp_path / "LEAN.csv").write_text("the one from yesterday\n")
    line = command.refused(tmp_path, "replay", log, "--calibration", cal, "--out", tmp_path / "LEAN.csv", words=words)
    assert name.replace("\n", " ") in line


def test_calibration_names_its_bad_capture(tmp_path):
    """The message also comes if the faulty log is not the first capture."""
    poses = [command.still(tmp_path / f"pose{k}.csv", axis) for k, axis in enumerate(command.AXES.values())]
    poses[2].write_bytes(BAD["nan.csv"][0])
    out = tmp_path / "CAL.json"
    line = command.refused(tmp_path, "calibrate", "six", *poses, "--out", out, words="line 5: ay_g is 'nan'")
    assert "pose2.csv" in line


@pytest.mark.parametrize(("name", "words"), [(".", "contains no recording"), ("none.csv", "there is no such file")])
def test_directory_or_missing_log_is_refused(tmp_path, name, words):
    cal, out = command.write_cal(tmp_path / "CAL.json"), tmp_path / "LEAN.csv"
    command.refused(tmp_path, "replay", tmp_path / name, "--calibration", cal, "--out", out, words=words)


PLAIN = text(*GOOD)
SAME = {
    "byte order mark.csv": b"\xef\xbb\xbf" + PLAIN,
    "CRLF.csv": PLAIN.replace(b"\n", b"\r\n"),
    "no last newline.csv": PLAIN[:-1],
    "blank lines.csv": PLAIN + b"\n\n",
    "spaces.csv": PLAIN.replace(b",", b" , "),
    "packed.csv.gz": gzip.compress(PLAIN),
    "optional columns.csv": text(*[g + ",,12.5" for g in GOOD], header=command.HEADER + ",temp_c,speed_mps"),
    "another column.csv": text(*[g + ",hello" for g in GOOD], header=command.HEADER + ",note"),
    "another order.csv": text(
        *[",".join(reversed(g.split(","))) for g in GOOD], header=",".join(reversed(command.HEADER.split(",")))
    ),
}


@pytest.mark.parametrize("name", SAME)
def test_log_in_another_format_gives_the_same_result(tmp_path, name):
    cal = command.write_cal(tmp_path / "CAL.json")
    (tmp_path / "plain.csv").write_bytes(PLAIN)
    (tmp_path / name).write_bytes(SAME[name])
    for source, out in ("plain.csv", "expected.csv"), (name, "got.csv"):
        command.works("replay", tmp_path / source, "--calibration", cal, "--out", tmp_path / out)
    assert (tmp_path / "got.csv").read_text() == (tmp_path / "expected.csv").read_text()
