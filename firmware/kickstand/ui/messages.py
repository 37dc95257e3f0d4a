"""The display's words for every refusal and fault. Each code (see errors.py) has two lines of 16 characters."""

# Each row is code|first line|second line. {0}, {1} ... are the refusal's values. As one text the words take 3 KB of
# heap. As a dictionary the words would take 7 KB.
_LINES = """
moved|Moved!|Hold it still
vibration|Moved!|Hold it still
tilting|Moved!|Hold it still
saturated|Accel saturated|Check sensor
too-few|Too few readings|Check sensor
frozen-pose|Sensor frozen|Check wiring
gyro-offset|Gyro offset big|Hold still
stuck-accel|Accel {0} stuck|Check sensor
dead-gyro|Gyro {0} is dead|Check sensor
noisy-gyro|Gyro {0} is noisy|Check sensor
dead-axis|Axis {0} is dead|Check sensor
unclear|Poses unclear|Do them again
turned-fast|Turned too fast:|turn it slower
odd-axis|Axis {0} is off|Do them again
side-tilted|Side {0}: {1:.0f}\xdf off|Do them again
free-pose-off|Check: {0:.3f} g|Do them again
gyro-scale|Gyro {0}: {1:+.0f} %|Check sensor
gyro-reversed|Gyro {0} reversed|Check sensor
gyro-misfit|Gyro is {0:.0f}\xdf off|Check sensor
unproved-gyro|Gyro {0} not seen|Do them again
not-one-g|Reads {1:.2f} g!|Do six positions
same-pose|Same pose twice|Stand, then up
tilt-small|Tilt only {0:.1f}\xdf|Need {1:.0f}\xdf or more
tilt-large|Tilt {0:.0f}\xdf: over|{1:.0f}\xdf, do it again
gyro-tilt|Tilt {0:.0f}\xdf, gyro|says {1:.0f}\xdf: redo
not-written|Not saved: flash|Old one is kept
read-back|Not saved: flash|Old one is kept
incomplete|Incomplete:|flash it again
stopped|Calibration|stopped: fault
maxima-reset|Maxima reset|
no-memory|No memory for it|restart it
starting|Kickstand|starting
no-sensor|No sensor|check wiring
unknown-chip|Unknown sensor|WHO_AM_I 0x{0:02x}
no-chip|No MPU6050: 0x{1:02x}|answers 0x{0:02x}
not-kept|Sensor keeps no|settings: broken
bus-errors|Sensor answers,|wires are bad
other-chip|{0}|not supported
other-device|No sensor, but a|{0} 0x{1:02x}
exchanged|SDA and SCL are|exchanged
wire-low|{0} stays low|check wiring
no-pull-ups|No sensor: wires|open, no pull-up
no-pull-up|No sensor: open|{0}, no pull-up
sensor-fifo|Sensor: its FIFO|{0}
sensor-lost|Sensor lost|check wiring
sensor-frozen|Sensor frozen|starting again
sensor-silent|Sensor silent|starting again
sensor-reset|Sensor reset|starting again
readings-lost|Readings lost|board too busy
axis-ill|{0} {1} {2}|power off and on
clips|{0} clips|mount it softly
no-radio|No Bluetooth|on this board
no-pairing|LIVE_PIN: not|on this board
radio-fault|Bluetooth fault|restart it
live-memory|No Bluetooth:|no memory
gps-silent|GPS silent|check wiring
gps-garbled|GPS garbled|check GPS_BAUD
gps-other|GPS sends {0}|no RMC or VTG
gps-no-fix|GPS: no fix|needs open sky
no-pulse|Wheel: no pulse|ride, or wiring?
wheel-storm|Wheel: noise|check wiring
wheel-quick|Wheel: too quick|fewer pulses/m
no-driver|SD card:|no driver
no-card|No SD card|check, restart
recording|{0}|{1}
recording-ended|Recording ended|
out-of-memory|Rec. stopped|no memory
out-of-room|Rec. stopped|no room
flash-fault|Rec. stopped|flash fault
card-fault|Rec. stopped|card fault
usb-fault|Rec. stopped|USB not read
user-failed|user.py {0}|{1}
user-slow|user.py {0}|slow: {1} ms
user-memory|user.py left out|no memory
unreadable|config.py:|cannot be read
no-setting|config.py: what?|{0}
no-pins|config.py: set|{0}
pin-twice|config.py: wrong|pin used twice
needs-speed|config.py: wrong|car needs SPEED
speed-negative|Speed negative|Check its source
speed-stuck|Speed stuck at|{0:.1f} m/s
speed-late|Speed {0:.1f} s late|2 s at most
speed-unit|Speed {0:.1f} times|off: its unit?
no-speed|No speed|GPS or wheel?
not-driven|Not driven yet|Brake straight
not-stopped|Not stopped yet|Stand for {0:.0f} s
few-events|Brake straight|{0} of {1} done
parts-differ|Brakings differ|{0:.0f}\xdf: drive on
uncertain|Only +-{0:.1f}\xdf|Brake straight
other-side|Side was wrong?|hold = fix
mount-moved|Mount has moved|Align again
side-fixed|Side corrected|Set SIDE too
aligned|Aligned by drive|error about {0:.1f}\xdf
"""
_OTHER_SETTING = "config.py: wrong|{0}"  # {0} is the setting's name; the console says what is wrong with its value


def lines(refusal):
    """Return the two lines for a Refusal or a Notice, neither padded nor cut. A code without a row in _LINES belongs to
    a wrong setting."""
    return tuple(refusal.words(_LINES, _OTHER_SETTING).split("|"))
