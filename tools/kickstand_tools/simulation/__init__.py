"""Motorcycle rides whose lean is known at every instant, as an MPU6050 stuck on the bike would log them.

    from kickstand_tools.simulation.files import simulate
    simulate("hills", seed=3, out_dir="ride")
    # ride/POSE_1.csv to POSE_7.csv (the last one slanted), KICKSTAND.csv, UPRIGHT.csv, RIDE.csv, TRUTH.csv

The way of a sample: profiles (what the rider does) -> commands (as signals) -> physics/bike (how the bike leans and
turns) -> physics/kinematics with road and engine (what a perfect sensor on it measures) -> physics/chip (what the
MPU6050 reads). No mathematics of the firmware is used, so that these rides can judge it. `kickstand simulate` and
`kickstand evaluate` use them; scripted/ holds simpler rides that run on MicroPython too.
"""
