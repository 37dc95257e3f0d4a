// What the display shows, read from its two lines: the words of firmware/kickstand/ui and start.py.

// The lines as one text, joined by "|"; the kind; in few words, for beside the true lean. The first that fits counts.
const KINDS = [
  [/^\|$/, "dark", "nothing"],
  [/^Kickstand\|/, "starting", "starting"],
  [/^Safe mode/, "safe", "safe mode"],
  [/^(No sensor|No MPU6050|Unknown sensor|Sensor (lost|silent|reset)|Sensor frozen\|starting|Readings lost)/, "fault", "a fault"],
  [/^(Sensor (keeps|answers)|Sensor: its FIFO|SDA and SCL|\w+ stays low)|\|not supported$/, "fault", "a fault"],
  [/^Calibration\|stopped/, "stopped", "a fault"],
  [/^→/, "menu", "the menu"],
  [/^Raw /, "unaligned", "not aligned"],
  [/^On the stand,/, "ask-stand", "aligning"],
  [/^Stand: hold/, "take-stand", "aligning"],
  [/^Now upright:/, "ask-upright", "aligning"],
  [/^Upright: hold/, "take-upright", "aligning"],
  [/^Aligned!/, "aligned", "aligned"],
  [/^(Moved!|Accel saturated|Too few readings|Sensor frozen\|Check|Gyro offset)/, "spoilt", "refused"],
  [/^(Reads |Same pose|Tilt |Not saved)/, "unlike", "refused"],
  [/^(Side |Not on a side|Check|Slant it|Axis |Poses unclear|Saved, err)/, "six", "positions"],
  [/^Lean /, "lean", "not sure"],
  [/^Max left/, "maxima", "maxima"],
  [/^(Accel|Brake) +\d/, "force", "g"],
  [/^Formula /, "formula", "formula"],
  [/^ *-?\d+\.\d\d[ -]*\d+\.\d\d[ -]*\d+\.\d\dg\|/, "readings", "readings"],
  [/^(Rec|Rec\.) /, "recording", "recording"],
  [/^[A-Z0-9]{3,9} +-?\d+\.\d°C\|/, "info", "sensor info"],
];

/**
 * {kind, words} of the display's two lines; null for others, as for a line that is half written. Where the lean itself
 * is shown, this is of the kind "lean" too.
 */
export function shows(lines) {
  const text = lines.map((line) => line.trimEnd()).join("|");
  const found = KINDS.find(([pattern]) => pattern.test(text));
  return found ? { kind: found[1], words: found[2] } : null;
}
