"""What two lidars, merged, see around the base: the nearest hit in each of sixteen sectors."""

import numpy as np
from numpy.typing import NDArray

from odisar.config.robot import RobotSimulatorConfig
from odisar.simulators.robot.grid import Array, Grid
from odisar.simulators.robot.journey import Journey
from odisar.simulators.robot.odometry import true_pose

SECTORS = 16

_MAX_MARCHES = 200


def sense_ranges(
    stream: np.random.Generator, journey: Journey, stamps_s: Array, config: RobotSimulatorConfig
) -> Array:
    """Return ranges (sample, sector) [m] from the base's centre; sector 0 begins ahead, to port.

    Ranges stop at the configured reach and see the map, a blockage once it's there, and people.
    """
    ranges = config.ranges
    rays = SECTORS * ranges.rays_per_sector
    bearings = 2.0 * np.pi * (np.arange(rays) + 0.5) / rays
    pose = true_pose(journey.motion, stamps_s)
    angles = pose[:, 2:3] + bearings
    hits = np.empty(angles.shape)
    later = stamps_s >= journey.changed_s
    for grid, chosen in ((journey.grid, ~later), (journey.changed, later)):
        hits[chosen] = cast_rays(grid, pose[chosen, :2], angles[chosen], ranges.max_m)
    radius_m = config.disturbances.people.radius_m
    for crossing, begun_s in journey.motion.met:
        there = (stamps_s >= begun_s) & (stamps_s < begun_s + crossing.gone_s)
        people = np.array([crossing.at(moment - begun_s) for moment in stamps_s[there]])
        if len(people):
            on_them = _hit_discs(pose[there, :2], angles[there], people, radius_m)
            hits[there] = np.minimum(hits[there], on_them)
    nearest = hits.reshape(len(pose), SECTORS, ranges.rays_per_sector).min(axis=2)
    noisy = nearest + ranges.noise_m * stream.standard_normal(nearest.shape)
    seen = np.where(nearest < ranges.max_m, noisy, nearest)
    return np.asarray(np.clip(seen, 0.0, ranges.max_m))


def cast_rays(grid: Grid, origins: Array, angles: Array, max_m: float) -> Array:
    """Return how far rays at ``angles`` (origin, ray) go from ``origins`` (origin, 2) [m].

    Each ray marches by the clearance of where it is, so that it can't jump over anything
    (J. C. Hart, "Sphere tracing", 1996).
    """
    x, y = (np.repeat(origins[:, i], angles.shape[1]) for i in range(2))
    cos, sin = np.cos(angles).ravel(), np.sin(angles).ravel()
    gone = np.zeros(len(x))
    going: NDArray[np.intp] = np.arange(len(x))
    # Half a diagonal of a cell: a clearance is that of the cell's centre.
    slack_m, shortest_m = 0.71 * grid.resolution_m, 0.2 * grid.resolution_m
    for _ in range(_MAX_MARCHES):
        at_x, at_y = x[going] + gone[going] * cos[going], y[going] + gone[going] * sin[going]
        clear = grid.clearance_at(at_x, at_y)
        free = clear > 0.0
        going, clear = going[free], clear[free]
        gone[going] += np.maximum(clear - slack_m, shortest_m)
        going = going[gone[going] < max_m]
        if not len(going):
            break
    return np.minimum(gone, max_m).reshape(angles.shape)


def _hit_discs(origins: Array, angles: Array, centres: Array, radius_m: float) -> Array:
    """Return how far each ray (sample, ray) goes to its sample's disc; infinite if it misses."""
    x, y = (centres - origins).T[:, :, None]
    ahead = x * np.cos(angles) + y * np.sin(angles)
    aside = y * np.cos(angles) - x * np.sin(angles)
    depth2 = radius_m**2 - aside**2
    hits = (depth2 > 0.0) & (ahead > 0.0)
    return np.where(hits, np.maximum(ahead - np.sqrt(np.maximum(depth2, 0.0)), 0.0), np.inf)
