"""Is the simulated ferry a plausible ship? Standard trials in calm water, and its roll in weather.

The trials are those of the IMO's Standards for Ship Manoeuvrability (MSC.137(76), 2002): turning
circles and zigzags, with the thruster angle in the place of the rudder angle.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from odisar.config.simulators import VesselSimulatorConfig
from odisar.simulators.vessel.dynamics import STATE_ROWS, Current, Orders, advance
from odisar.simulators.vessel.fleet import ALL_COMPONENTS, RunPlan, variants
from odisar.simulators.vessel.hull import KNOT_M_S, Array, ferry
from odisar.simulators.vessel.maneuvers import Helm
from odisar.simulators.vessel.runs import CHANNELS, simulate_runs
from odisar.simulators.vessel.wind import wind_force

_ANGLES_DEG = (10.0, 15.0, 20.0, 30.0)
_STRAIGHT_S, _TRIAL_S = 400.0, 600.0
#: Yaw rate given to a ship on a straight course [rad/s]; a stable one forgets it.
_NUDGE_RAD_S = np.deg2rad(0.2)


@dataclass(frozen=True)
class _Trials:
    """Trials side by side: a straight course, a turn for each angle, a zigzag for each angle.

    ``states`` is (step, row, run) from the end of the straight course on, ``orders_deg`` (step,
    run); ``nudged_yaw_rate`` [rad/s] is what's left of the nudge when the straight course ends.
    """

    states: Array
    orders_deg: Array
    nudged_yaw_rate: float


def plausibility_table(config: VesselSimulatorConfig, base_seed: int) -> pd.DataFrame:
    """Return what the ferry does beside what a ship of its kind does.

    Columns ``quantity``, ``angle_deg`` (NaN where there's none), ``value``, ``unit``, ``low``,
    ``high``, ``plausible``. The roll is the largest in any manoeuvre at strength 1.
    """
    trials = _run_trials(config)
    service_kn = config.ferry.service_speed_kn
    calm_speed = trials.states[0, 4, 0]
    straight = [
        (
            "calm-water speed",
            np.nan,
            calm_speed / KNOT_M_S,
            "kn",
            0.95 * service_kn,
            1.05 * service_kn,
        ),
        (
            "share left of a nudge in yaw rate",
            np.nan,
            abs(trials.nudged_yaw_rate) / _NUDGE_RAD_S,
            "1",
            0.0,
            0.1,
        ),
    ]
    hull = ferry(config.ferry)
    roll_period_s = 2.0 * np.pi * float(np.sqrt(hull.roll_inertia / hull.roll_stiffness))
    roll = _largest_roll_deg(config, base_seed)
    rows = [
        *straight,
        *_turning_rows(trials, config.ferry.length_m),
        *_zigzag_rows(trials),
        ("natural roll period", np.nan, roll_period_s, "s", 8.0, 15.0),
        ("largest roll in the strongest disturbance", np.nan, roll, "deg", 0.0, 7.0),
    ]
    table = pd.DataFrame(rows, columns=["quantity", "angle_deg", "value", "unit", "low", "high"])
    table["plausible"] = table["value"].between(table["low"], table["high"])
    return table


def trial_traces(config: VesselSimulatorConfig) -> pd.DataFrame:
    """Return what the ferry did in the calm-water trials, to be drawn.

    Columns ``trial`` (turning or zigzag), ``angle_deg``, ``time_s`` from the first order on,
    ``ahead`` and ``aside`` [ship lengths, to port], ``turned_deg`` (to port) and ``order_deg``.
    """
    trials = _run_trials(config)
    time_s = np.arange(len(trials.states)) * config.step_s
    tables = []
    for run in range(1, 1 + 2 * len(_ANGLES_DEG)):
        north, east, _, heading, *_ = trials.states[:, :, run].T
        is_turn = run <= len(_ANGLES_DEG)
        tables.append(
            pd.DataFrame(
                {
                    "trial": "turning" if is_turn else "zigzag",
                    "angle_deg": _ANGLES_DEG[(run - 1) % len(_ANGLES_DEG)],
                    "time_s": time_s,
                    "ahead": (north - north[0]) / config.ferry.length_m,
                    "aside": -(east - east[0]) / config.ferry.length_m,
                    "turned_deg": -np.rad2deg(heading - heading[0]),
                    "order_deg": trials.orders_deg[:, run],
                }
            )
        )
    return pd.concat(tables, ignore_index=True)


_Row = tuple[str, float, float, str, float, float]


def _turning_rows(trials: _Trials, length: float) -> list[_Row]:
    rows: list[_Row] = []
    straight_speed = trials.states[0, 4, 0]
    for run, angle in enumerate(_ANGLES_DEG, start=1):
        _, east, _, heading, u, v, *_ = trials.states[:, :, run].T
        # Trials head north and turn to port: the diameter is measured at half a turn.
        half_turn = int(np.argmax(heading[0] - heading >= np.pi))
        diameter = abs(east[half_turn] - east[0]) / length
        rows.append(("tactical diameter", angle, diameter, "ship lengths", 2.0, 7.0))
    ratio = float(np.hypot(u[-1], v[-1]) / straight_speed)
    rows.append(("speed in the turn over speed before it", angle, ratio, "1", 0.6, 0.7))
    return rows


def _zigzag_rows(trials: _Trials) -> list[_Row]:
    rows: list[_Row] = []
    for run, angle in enumerate(_ANGLES_DEG, start=1 + len(_ANGLES_DEG)):
        turned = np.rad2deg(trials.states[:, 3, run] - trials.states[0, 3, run])
        reversals = np.flatnonzero(np.diff(trials.orders_deg[:, run])) + 1
        overshoots = [
            np.max(np.abs(turned[begin:end])) - angle for begin, end in pairwise(reversals)
        ]
        for name, value in (("first", overshoots[0]), ("largest", max(overshoots))):
            rows.append((f"{name} zigzag overshoot", angle, float(value), "deg", 4.0, 15.0))
    return rows


def _run_trials(config: VesselSimulatorConfig) -> _Trials:
    zigzag = np.array([0.0, *(0.0 for _ in _ANGLES_DEG), *_ANGLES_DEG])
    turning = np.array([0.0, *_ANGLES_DEG, *(0.0 for _ in _ANGLES_DEG)])
    runs = len(zigzag)
    hull, zero = ferry(config.ferry), np.zeros(runs)
    time_s = np.arange(-_STRAIGHT_S, _TRIAL_S, config.step_s)
    schedule = np.where(time_s[:, None] >= 0.0, turning, 0.0)
    helm = Helm(schedule, zigzag, side=np.ones(runs), start_s=zero)
    state = np.zeros((len(STATE_ROWS), runs))
    state[4], state[9] = config.ferry.service_speed_kn * KNOT_M_S, config.ferry.rpm
    nudged = 0.0
    states, orders_deg = [], []
    for step, now_s in enumerate(time_s):
        if now_s == -0.5 * _STRAIGHT_S:
            state[7, 0] = _NUDGE_RAD_S
        order_deg = helm.order(step, now_s, state[3])
        if now_s >= 0.0:
            states.append(state)
            orders_deg.append(order_deg)
            nudged = state[7, 0] if now_s == 0.0 else nudged
        air = wind_force(config.ferry.windage, hull.length, state, zero, zero, zero)
        orders = Orders(np.deg2rad(order_deg), np.full(runs, config.ferry.rpm))
        state = advance(hull, state, orders, Current(zero, zero), (air, air, air), config.step_s)
    return _Trials(np.array(states), np.array(orders_deg), float(nudged))


def _largest_roll_deg(config: VesselSimulatorConfig, base_seed: int) -> float:
    plans = [
        RunPlan(
            name=f"strongest-{maneuver}-{variant}-{case}",
            seed_name=f"test-{maneuver}-{variant}-{case}",
            split="test",
            maneuver=maneuver,
            variant=variant,
            disturbance=case,
            components=ALL_COMPONENTS,
            strength=1.0,
        )
        for maneuver, variant in variants(config.maneuvers)
        for case in ("case-1", "case-2", "case-3")
    ]
    roll = CHANNELS.index("Roll Angle")
    logged = [recording.values for recording in simulate_runs(plans, config, base_seed)]
    return float(np.max(np.abs(np.stack(logged)[:, :, roll])))
