"""A ferry with two azimuth thrusters, in weather: a model in surge, sway, roll and yaw.

The equations are those of NTNU's public four-degree-of-freedom model of R/V Gunnerus. The same
code first sails Gunnerus through a recorded sea trial (``validation``), then a ferry through
manoeuvres in labelled weather (``runs``). Every array has a last axis ``run``; no operation mixes
runs, so a recording doesn't depend on which others are made beside it.
"""

from odisar.simulators.vessel.plausibility import plausibility_table, trial_traces
from odisar.simulators.vessel.runs import simulate_vessel
from odisar.simulators.vessel.validation import sea_trial_table, validation_traces

__all__ = [
    "plausibility_table",
    "sea_trial_table",
    "simulate_vessel",
    "trial_traces",
    "validation_traces",
]
