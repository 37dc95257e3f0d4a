"""Simulates motorcycle rides with a known lean at every instant, as an MPU6050 on the bike would log them.

    from kickstand_tools.simulation.files import simulate
    simulate("hills", seed=3, out_dir="ride")
    # ride/POSE_1.csv to POSE_7.csv (the last one slanted), SIX.csv, KICKSTAND.csv, UPRIGHT.csv, RIDE.csv, TRUTH.csv

The path of a sample: profiles (the rider's actions) -> commands (signals of these actions) -> physics/bike (lean and
turns of the bike) -> physics/kinematics with road and engine (measurements of a perfect sensor) -> physics/chip
(readings of the MPU6050). The simulation does not use the firmware's mathematics, because it tests them.

Choose a simulated ride:
* ride.py, with the physics above, shows whether a lean or an alignment is right, and how accurate. `kickstand
simulate`, `evaluate` and the tests of filters, smoother, calibrations and checks use it. It needs only numpy.
* scripted/, a bike in exact balance, shows what a board, its display and its files do in a given second. The demo, the
bench and the tests of whole devices use it, because it also runs on MicroPython. It simulates neither suspension nor
wind nor a moving rider, so it shows little about the accuracy of a lean. demo/hand_bike.py is similar, but steered by
hand.
* kickstand_fleet/simulation makes short, partly faulty drives of many cars, buses and motorcycles. It shows which
faults `fleet` finds.

Choose a board: simulated_board runs the firmware's Python on this computer and shows what the firmware displays and
does. Its times come from models, and its memory is this computer's. If time, memory, machine code, flash or a power
loss matters, use the Pico of kickstand_emulator, which runs MicroPython's own image on emulated instructions. Use its
ESP32 only for features of ESP32s, because its times are estimates.
"""
