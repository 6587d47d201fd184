"""The simulated ferry behaves as a ship of its kind, in calm water and in the worst weather."""

import numpy as np
import pytest

from odisar.simulators.vessel.dynamics import (
    Current,
    Orders,
    advance,
    no_force,
    ordered_sum,
)
from odisar.simulators.vessel.hull import ferry
from odisar.simulators.vessel.plausibility import plausibility_table

SEED = 20251122


@pytest.fixture(scope="module")
def table(vessel):
    return plausibility_table(vessel, SEED)


def test_everything_lies_in_its_range(table):
    outside = table[~table["plausible"]]
    assert outside.empty, f"\n{outside}"


def test_the_ranges_are_those_of_ships(table):
    limits = table.groupby("quantity")[["low", "high"]].first()
    assert limits.loc["tactical diameter"].tolist() == [2.0, 7.0]
    assert limits.loc["largest zigzag overshoot"].tolist() == [4.0, 15.0]
    assert limits.loc["speed in the turn over speed before it"].tolist() == [0.6, 0.7]
    assert limits.loc["largest roll in the strongest disturbance"].tolist() == [0.0, 7.0]


def test_a_larger_angle_turns_tighter(table):
    diameters = table.loc[table["quantity"] == "tactical diameter", "value"]
    assert diameters.is_monotonic_decreasing


def test_a_locked_bow_thruster_turns_wider(vessel, table):
    locked = vessel.model_copy(
        update={"ferry": vessel.ferry.model_copy(update={"bow_thruster": "locked"})}
    )
    wider = plausibility_table(locked, SEED)
    chosen = table["quantity"] == "tactical diameter"
    assert (wider.loc[chosen, "value"] > table.loc[chosen, "value"]).all()


def _drifted(vessel, current, seconds=3000.0):
    """Return the final state of a ship without thrust in a current."""
    state = np.zeros((10, 1))
    calm, idle = no_force(1), Orders(np.zeros(1), np.zeros(1))
    hull = ferry(vessel.ferry)
    for _ in range(int(seconds / 0.5)):
        state = advance(hull, state, idle, current, (calm, calm, calm), 0.5)
    return state[:, 0]


def test_a_ship_without_thrust_ends_up_drifting_with_the_current(vessel):
    state = _drifted(vessel, Current(np.zeros(1), np.array([1.0])))
    cos, sin = np.cos(state[3]), np.sin(state[3])
    north, east = state[4] * cos - state[5] * sin, state[4] * sin + state[5] * cos
    assert north == pytest.approx(0.0, abs=0.1)
    assert east == pytest.approx(1.0, abs=0.1)


def test_the_step_is_short_enough(vessel):
    """Halving the step hardly moves a 30 degree turn."""
    hull, calm = ferry(vessel.ferry), no_force(1)
    ends = []
    for step_s in (0.5, 0.25):
        state = np.zeros((10, 1))
        state[4], state[9] = 7.0, vessel.ferry.rpm
        orders = Orders(np.deg2rad([30.0]), np.array([vessel.ferry.rpm]))
        still = Current(np.zeros(1), np.zeros(1))
        for _ in range(int(300 / step_s)):
            state = advance(hull, state, orders, still, (calm, calm, calm), step_s)
        ends.append(state[[2, 4, 5, 7], 0])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-3)


def test_a_sum_has_the_same_bits_alone_and_in_company():
    terms = np.random.default_rng(4).standard_normal((24, 50))
    together = ordered_sum(terms)
    for run in range(50):
        assert ordered_sum(terms[:, run : run + 1])[0] == together[run]
