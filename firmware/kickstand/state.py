"""The app's state as data for other programs, such as a simulation or a test."""

STEPS = ("ask", "take", "notice", "refused", "result", "ended", "compute")  # names of the states 0 to 6 of ui/wizard.py


def state(app):
    """Return the state of an App as a dictionary of plain values. The display got this state at most 100 ms ago.

    Returns:
        view: "notice", "align", "six", "menu", "info", "fault", "question", or the name of a page (see PageRing.name).
        code: the code of the notice, fault, question or refusal that is shown, or None (see errors.py).
        step: the step of an alignment or of the six positions, from STEPS, or None.
        pose: the pose of an alignment, "kickstand" or "upright", or None.
        entry: the name of the menu entry that is shown, or None.
        trusted: True if the lean may be shown.
        lean_deg: the lean in degrees, positive to the right, or None if it may not be shown.
        aligned: True if the sensor is aligned.
        recording: True while a ride is being recorded.
        fault: the code of the sensor's fault, or None.
    """
    screen, fault, trusted = app.screen, app.sensor.fault, app.trusted
    view = screen.front
    notice = {"fault": fault, "question": app.drive and app.drive.message, "notice": view}.get(view.name)
    if view.name in ("align", "six"):
        notice = view.problem
    return {
        "view": view.name,
        "code": notice.code if notice else None,
        "step": STEPS[view.state] if view.name in ("align", "six") else None,
        "pose": ("upright" if view.upright else "kickstand") if view.name == "align" else None,
        "entry": view.entry if view.name == "menu" else None,
        "trusted": trusted,
        "lean_deg": app.meter.lean_deg if trusted else None,
        "aligned": app.calibration.aligned,
        "recording": app.recording,
        "fault": fault.code if fault else None,
    }
