"""What to do about input that cannot be used, by name: in the words of the command line, and in those of a page."""

from collections.abc import Mapping

Remedies = Mapping[str, str]

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
    "six_positions": "kickstand calibrate six takes that out",
    "sign": "--units a=-g or a=-m/s2 puts it right",
    "speed_unit": "add --units speed=km/h, mph or m/s",
}

_BY_RIDE = "remove the calibration and let the ride show how the sensor sits"

# The page Rides has neither commands nor options
PAGE = {
    "align": _BY_RIDE,
    "align_again": "Remove the calibration and let the ride show how the sensor sits, or align the bike again",
    "align_again_car": "Give the calibration of this mount",
    "align_car": "this page aligns motorcycles only",
    "align_driving": "was it aligned while driving backwards?",
    "less_pitch": f"{_BY_RIDE}, or align the bike again, on level ground",
    "less_roll": f"{_BY_RIDE}, or align the bike again, held upright",
    "less_yaw": _BY_RIDE,
    "less_yaw_by_speed": _BY_RIDE,
    "give_calibration": "give the .cal.json of the ride",
    "import_log": "give it as the app has exported it",
    "import_zip": "give it as the app has exported it",
    "name_columns": "needed are a time, the acceleration along three axes and the rates of a gyro about them",
    "name_units": "choose them",
    "other_side": "does the kickstand lean the bike to the other side than SIDE in config.py says?",
    "phone_otherwise": "",
    "six_positions": "the six positions of the sensor take that out",
    "sign": "left is shown as right",
    "speed_unit": "write it in brackets behind that name, as in Speed (km/h)",
}
