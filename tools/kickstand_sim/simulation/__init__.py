"""Simulates motorcycle rides as an MPU6050 on the bike would log them. The true lean is known at every instant.

    from kickstand_sim.simulation.files import simulate
    simulate("hills", seed=3, out_dir="ride")

A sample passes profiles (the rider's actions), commands (signals over time), physics/bike and road (what a perfect
sensor measures) and physics/chip (the MPU6050 and its mount). The simulation does not use the firmware's mathematics,
because it tests them.

Choose a simulated ride:
* ride.py uses this physics. It shows how accurate a lean or an alignment is.
* scripted/ simulates a bike in exact balance, also on MicroPython. It shows what a board, its display and its files do
at a given time, but little about the accuracy of a lean. demo/hand_bike.py is similar, but you steer it.
* kickstand_fleet/simulation simulates short drives of many vehicles, some of them with faults.

Choose a board:
* simulated_board runs the firmware's Python on this computer. Its times come from models, its memory is the computer's.
* The Pico of kickstand_emulator runs MicroPython's own image. Use it if time, memory, machine code, flash or a power
loss matters. Its ESP32 is only for features of ESP32s, because its times are estimates.
"""
