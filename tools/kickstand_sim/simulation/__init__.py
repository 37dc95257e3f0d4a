"""Simulates motorcycle rides as an MPU6050 on the bike would log them. The true lean is known at every instant.

    from kickstand_sim.simulation.files import simulate
    simulate("hills", seed=3, out_dir="ride")
    # ride/POSE_1.csv to POSE_7.csv (the last one slanted), SIX.csv, KICKSTAND.csv, UPRIGHT.csv, RIDE.csv, TRUTH.csv

These modules compute a sample, in this order:

    profiles                              the rider's actions
    commands                              signals over time of these actions
    physics/bike                          lean and turns of the bike
    physics/kinematics, road, engine      measurements of a perfect sensor
    physics/chip                          readings of the MPU6050

The simulation does not use the firmware's mathematics, because it tests them.

Choose a simulated ride:
* ride.py uses the physics above. It shows whether a lean or an alignment is right, and how accurate it is. `kickstand
simulate`, `evaluate` and the tests of filters, smoother, calibrations and checks use it. It needs only numpy.
* scripted/ simulates a bike in exact balance. It shows what a board, its display and its files do at a given time. The
demo, the bench and the tests of whole devices use it, because it also runs on MicroPython. It has no suspension, no
wind and no moving rider, so it shows little about the accuracy of a lean. demo/hand_bike.py is similar, but you steer
the bike by hand.
* kickstand_fleet/simulation simulates short drives of many cars, buses and motorcycles, some of them with faults. It
shows which faults `fleet` finds.

Choose a board:
* simulated_board runs the firmware's Python on this computer. It shows what the firmware displays and does. Its times
come from models, and its memory is this computer's.
* The Pico of kickstand_emulator runs MicroPython's own image on emulated instructions. Use it if time, memory, machine
code, flash or a power loss matters.
* The ESP32 of kickstand_emulator is only for features of ESP32s, because its times are estimates.
"""
