"""A motorcycle and where the sensor sits on it."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Bike:
    """Lengths in m. Figures from V. Cossalter, Motorcycle Dynamics, 2nd ed., chapters 3, 4, 6 and 8.

    The defaults are an average naked bike with its rider; random() varies them as bikes on the road do.
    """

    mass_height: float = 0.62  # of bike and rider together, above the ground
    roll_gyration: float = 0.27  # radius of gyration about the roll axis through the centre of mass
    tyre_radius: float = 0.06  # of the tyres' cross-section, mean of front and rear
    wheel_inertia: float = 0.024  # both wheels' I/r over mass * mass_height: their gyroscopic moment in a turn
    wheelbase: float = 1.43
    sensor_height: float = 0.70
    sensor_forward: float = 0.75  # of the rear contact point
    sensor_left: float = 0.0
    dive_deg_per_mps2: float = 0.3  # 3 degrees of nose down at 1 g of braking
    dive_hz: float = 1.7
    dive_damping: float = 0.45
    max_curvature: float = 0.4  # 1/m: the steering lock

    @staticmethod
    def random(chance: np.random.Generator) -> "Bike":
        return Bike(
            mass_height=chance.uniform(0.55, 0.68),
            roll_gyration=chance.uniform(0.22, 0.30),
            tyre_radius=chance.uniform(0.045, 0.075),
            wheel_inertia=chance.uniform(0.018, 0.03),
            wheelbase=chance.uniform(1.38, 1.52),
            sensor_height=chance.uniform(0.6, 0.8),
            sensor_forward=chance.uniform(0.4, 1.1),
            sensor_left=chance.uniform(-0.1, 0.1),
            dive_deg_per_mps2=chance.uniform(0.2, 0.4),
            dive_hz=chance.uniform(1.4, 2.1),
            dive_damping=chance.uniform(0.35, 0.6),
        )

    @property
    def pendulum(self) -> float:
        """Length of the equivalent pendulum in roll, m: the longer, the slower the bike falls into a lean."""
        return (self.mass_height**2 + self.roll_gyration**2) / self.mass_height
