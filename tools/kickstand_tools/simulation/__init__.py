"""Motorcycle rides whose lean is known at every instant, as an MPU6050 stuck on the bike would log them.

    from kickstand_tools.simulation.files import simulate
    simulate("hills", seed=3, out_dir="ride")
    # ride/POSE_1.csv to POSE_7.csv (the last one free), KICKSTAND.csv, UPRIGHT.csv, RIDE.csv, TRUTH.csv

The way of a sample: profiles (what the rider does) -> commands -> balance (how the bike leans and turns) ->
kinematics with road and engine (what a perfect sensor there feels) -> chip (what the MPU6050 makes of it).
Nothing here is taken from the firmware: it is there to judge it.
"""
