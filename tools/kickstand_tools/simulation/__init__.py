"""Motorcycle rides whose lean is known at every instant, as an MPU6050 stuck on the bike would log them.

    from kickstand_tools.simulation.files import simulate
    simulate("hills", seed=3, out_dir="ride")
    # ride/POSE_1.csv to POSE_7.csv (the last one slanted), SIX.csv, KICKSTAND.csv, UPRIGHT.csv, RIDE.csv, TRUTH.csv

The way of a sample: profiles (what the rider does) -> commands (as signals) -> physics/bike (how the bike leans and
turns) -> physics/kinematics with road and engine (what a perfect sensor on it measures) -> physics/chip (what the
MPU6050 reads). No mathematics of the firmware is used, so that these rides can judge it.

Which simulated ride for what:
* ride.py, of the physics above: whether a lean or an alignment is right, and how exact. `kickstand simulate` and
  `evaluate` and the tests of filters, smoother, calibrations and checks take it. Numpy only.
* scripted/, a bike in exact balance: what a board, its display and its files do in a given second. The demo, the bench
  and the tests of whole devices take it, because it runs on MicroPython too. It has neither suspension nor wind nor a
  rider, so it says little of how exact a lean is. demo/hand_bike.py is the same, ridden by hand.
* fleet/, short drives of many cars, buses and motorcycles with troubles: which of them a fleet's run finds.

And on which board: simulated_board runs the firmware's Python on this computer, and shows what it says and does; its
times are those of models, its memory is this computer's. Where time, memory, machine code, flash or a loss of power
matters, emulator's Pico is the reference: MicroPython's own image on emulated instructions. Its ESP32 is for what is
particular to ESP32s; its times are estimates.
"""
