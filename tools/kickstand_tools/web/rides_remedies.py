"""What to do about input that cannot be used, in the words of the page Rides: see kickstand_tools.remedies."""

AGAIN = "Remove the calibration, and let the ride tell how the sensor sits, or align the bike again"

REMEDIES = {
    "align": "remove it, and let the ride tell how the sensor sits",
    "align_again": AGAIN,
    "align_again_car": "Give the calibration of this mount",
    "align_car": "this page aligns motorcycles only",
    "align_driving": "was it aligned while driving backwards?",
    "less_pitch": "aligned from the ride, or again on level ground, it is gone",
    "less_roll": "aligned from the ride, or again with the bike held upright, it is gone",
    "less_yaw": "aligned from the ride it is gone",
    "less_yaw_by_speed": "aligned from the ride it is gone",
    "give_calibration": "give the .cal.json of the ride",
    "import_log": "give it as the app has exported it",
    "import_zip": "give it as the app has exported it",
    "install_pyarrow": "this page cannot read it. Export the ride as CSV",
    "name_columns": "say which of its columns is what",
    "name_units": "choose them",
    "other_side": "does the kickstand lean the bike to the side that the setting SIDE does not name?",
    "phone_otherwise": "",
    "sign": "left is shown as right",
    "speed_unit": "write it in brackets behind the column’s name, as Speed (km/h)",
}
