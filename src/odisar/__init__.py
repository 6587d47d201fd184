"""ODiSAR: out-of-distribution detection for self-adaptive robots and vessels.

A *digital twin model* (DTM) forecasts the next ``h`` steps of a system's states and reconstructs
its own forecast. A *digital twin capability* (DTC) turns the twin's output into a score,
thresholds, four confidence quadrants and the states to blame.

The way of the data, which is also the only direction of imports::

    recordings -> windows -> twin -> capability -> evaluation -> report

Axis order everywhere: ``(draw, window, step, state)``. "Scaled" means standardised with the mean
and standard deviation of the training recordings; "physical" means in the unit of the channel.

Source: E. Isaku et al., "Out of Distribution Detection in Self-adaptive Robots with AI-powered
Digital Twins", 2025.
"""

__version__ = "0.1.0"
