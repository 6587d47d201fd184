"""The office has a way to everywhere; paths keep clear of it; lidars see it."""

import numpy as np
import pytest

from odisar.simulators.robot import map_traces, plausibility_table
from odisar.simulators.robot.grid import Grid
from odisar.simulators.robot.office import build_office
from odisar.simulators.robot.planning import Planner
from odisar.simulators.robot.ranges import cast_rays

SEED = 11


@pytest.fixture(scope="module")
def box() -> Grid:
    """A room of 10 x 6 m between walls of 0.1 m."""
    occupied = np.zeros((124, 204), dtype=bool)
    occupied[:2] = occupied[-2:] = True
    occupied[:, :2] = occupied[:, -2:] = True
    return Grid(occupied, 0.05)


def test_the_office_is_walled_and_always_the_same(robot, office):
    again = build_office(robot.office, SEED)
    np.testing.assert_array_equal(office.occupied, again.occupied)
    assert office.occupied.shape == (520, 880)
    for border in (office.occupied[0], office.occupied[-1], office.occupied.T[0]):
        assert border.all()
    assert 0.03 < office.occupied.mean() < 0.2


def test_nearly_all_free_space_can_be_reached(robot, office):
    planner = Planner(office, robot.planner)
    free = office.clearance_m >= robot.planner.clearance_m
    covered_m2 = len(planner.nodes) * robot.planner.cell_m**2
    assert covered_m2 > 0.95 * free.sum() * office.resolution_m**2


def test_clearance_is_the_distance_to_the_nearest_wall(box):
    x, y = np.array([5.125, 0.625]), np.array([3.125, 3.125])
    np.testing.assert_allclose(box.clearance_at(x, y), [3.0, 0.5], atol=0.051)


def test_paths_keep_clear_and_join_their_ends(robot, office):
    planner = Planner(office, robot.planner)
    stream = np.random.default_rng(4)
    for _ in range(5):
        start, goal = planner.nodes[stream.integers(len(planner.nodes), size=2)]
        path = planner.path(start, goal)
        np.testing.assert_allclose(path[[0, -1]], [start, goal], atol=1e-9)
        assert office.clearance_at(*path.T).min() > 0.5 * robot.base.width_m
        assert np.hypot(*np.diff(path, axis=0).T).max() < 0.15


def test_rays_end_at_the_walls(box):
    angles = np.array([[0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi, np.arctan2(3.0, 4.0)]])
    hits = cast_rays(box, np.array([[5.1, 3.1]]), angles, 30.0)
    np.testing.assert_allclose(hits, [[5.0, 3.0, 5.0, 3.0, 5.0]], atol=0.1)
    assert cast_rays(box, np.array([[5.1, 3.1]]), angles, 2.0).max() == 2.0


def test_rays_see_a_box_that_has_been_put_in(box):
    with_box = box.with_box(np.array([7.0, 3.1]), 0.0, (0.2, 1.0))
    hits = cast_rays(with_box, np.array([[5.1, 3.1]]), np.array([[0.0, np.pi]]), 30.0)
    np.testing.assert_allclose(hits, [[1.7, 5.0]], atol=0.1)


def test_everything_lies_in_its_range(small_robot):
    table = plausibility_table(small_robot, SEED)
    outside = table[~table["plausible"]]
    assert outside.empty, f"\n{outside}"
    assert list(table.columns) == ["quantity", "value", "unit", "low", "high", "plausible"]


def test_map_traces_lie_in_the_office(small_robot):
    traces = map_traces(small_robot, SEED)
    assert len(traces.paths) == len(traces.waypoints) == 2
    grid = Grid(traces.occupied, traces.resolution_m)
    for path, waypoints in zip(traces.paths, traces.waypoints, strict=True):
        assert not grid.is_occupied(*path.T).any()
        assert waypoints.shape == (6, 2)
