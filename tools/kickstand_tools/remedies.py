"""What to do about input that cannot be used, in the words of the command line.

A page has no commands and no options. It gives words of its own for the same names (web/rides_remedies.py).
"""

from collections.abc import Mapping

# {0}, {1} ... are values that the error gives
COMMANDS = {
    "align": "kickstand calibrate two, or calibrate ride, first",
    "align_again": "Calibrate again: calibrate two, or calibrate ride",
    "align_again_car": "Calibrate again: calibrate drive",
    "align_car": "with a speed in the log take kickstand calibrate drive --vehicle car",
    "align_driving": "calibrate drive again?",
    "less_pitch": "calibrate ride takes it out, or calibrate two, on level ground",
    "less_roll": "calibrate ride takes it out, or calibrate two, held upright",
    "less_yaw": "calibrate ride takes it out",
    "less_yaw_by_speed": "calibrate ride or drive takes it out",
    "give_calibration": "give a file made by kickstand calibrate",
    "import_log": "an app's export has to go through kickstand import first",
    "import_zip": "if an app has exported it, kickstand import makes a log of it",
    "name_columns": "{0}",
    "name_units": "add --units {0} ({1})",
    "other_side": "calibrate two {0}?",
    "phone_otherwise": "Then leave out --phone",
    "sign": "--units a=-g or a=-m/s2 puts it right",
    "speed_unit": "add --units speed=km/h, mph or m/s",
}

Remedies = Mapping[str, str]
