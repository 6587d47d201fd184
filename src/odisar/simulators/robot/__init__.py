"""An omnidirectional robot base on waypoint tasks in an office.

A map, a planner that keeps clear of walls, a holonomic controller with limits, and the odometry
that its wheels make of it. Disturbances act on the odometry (noise, bias, drift) or on the motion
itself (slip, a blocked passage, people). Each task has its own streams of random numbers, so a
recording doesn't depend on which others are made.
"""

from odisar.simulators.robot.plausibility import map_traces, plausibility_table
from odisar.simulators.robot.runs import CHANNELS, RANGE_CHANNELS, simulate_robot

__all__ = ["CHANNELS", "RANGE_CHANNELS", "map_traces", "plausibility_table", "simulate_robot"]
