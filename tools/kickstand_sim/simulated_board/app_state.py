"""The state of the firmware's App as data. Runs on CPython and MicroPython."""


def state(app):
    """Return the state of an App as a dictionary of plain values. The display got this state at most 100 ms ago.

    Returns:
        view: see Screen.
        code: the code of the notice, fault, question or refusal that is shown, or None (see errors.py).
        step: the step of an alignment or of the six positions (see ui/wizard.py), or None.
        pose: the pose of an alignment, "kickstand" or "upright", or None.
        entry: the name of the menu entry that is shown, or None.
        trusted: True if the lean may be shown.
        lean_deg: the lean in degrees, positive to the right, or None if it may not be shown.
        aligned: True if the sensor is aligned.
        recording: True while a ride is being recorded.
        fault: the code of the sensor's fault, or None.
    """
    screen, fault, lean_deg = app.screen, app.sensor.fault, app.lean_deg
    view = screen.view
    wizard = screen.wizard if view in ("align", "six") else None
    notice = wizard.notice if wizard else screen.shown
    return {
        "view": view,
        "code": notice.code if notice else None,
        "step": wizard.step if wizard else None,
        "pose": ("upright" if wizard.upright else "kickstand") if wizard and view == "align" else None,
        "entry": screen.menu.entry if view == "menu" else None,
        "trusted": lean_deg is not None,
        "lean_deg": lean_deg,
        "aligned": app.calibration.aligned,
        "recording": app.recording,
        "fault": fault.code if fault else None,
    }
