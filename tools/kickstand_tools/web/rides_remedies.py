"""What to do about input that cannot be used, in the words of the page Rides: see kickstand_tools.remedies."""

BY_RIDE = "remove the calibration and let the ride tell how the sensor sits"

REMEDIES = {
    "align": BY_RIDE,
    "align_again": "Remove the calibration and let the ride tell how the sensor sits, or align the bike again",
    "align_again_car": "Give the calibration of this mount",
    "align_car": "this page aligns motorcycles only",
    "align_driving": "was it aligned while driving backwards?",
    "less_pitch": f"{BY_RIDE}, or align the bike again, on level ground",
    "less_roll": f"{BY_RIDE}, or align the bike again, held upright",
    "less_yaw": BY_RIDE,
    "less_yaw_by_speed": BY_RIDE,
    "give_calibration": "give the .cal.json of the ride",
    "import_log": "give it as the app has exported it",
    "import_zip": "give it as the app has exported it",
    "name_columns": "needed are a time, the acceleration along three axes and the rates of a gyro about them",
    "name_units": "choose them",
    "other_side": "does the kickstand lean the bike to the other side than SIDE in config.py says?",
    "phone_otherwise": "",
    "sign": "left is shown as right",
    "speed_unit": "write it in brackets behind that name, as in Speed (km/h)",
}
