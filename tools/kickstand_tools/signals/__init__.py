"""What is done to arrays of samples everywhere: numpy only, no log and no file.

averages.py: moving means, standard deviations, integrals. cells.py: means over cells of time. lag.py: one signal
against another. rotations.py: rotation vectors and matrices. standstill.py: when a vehicle stands.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
