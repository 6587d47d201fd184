"""Make the recordings: plan the fleet, sail all runs side by side, log them as sensors would."""

from collections.abc import Iterator, Sequence

import numpy as np

from odisar.config.simulators import VesselSimulatorConfig
from odisar.recordings.schema import UNDISTURBED, Interval, Recording, RecordingInfo
from odisar.simulators.vessel.conditions import Conditions
from odisar.simulators.vessel.dynamics import STATE_ROWS, Current, Orders, advance
from odisar.simulators.vessel.fleet import RunPlan, plan_fleet
from odisar.simulators.vessel.hull import Array, ferry
from odisar.simulators.vessel.maneuvers import Helm, scheduled_angle
from odisar.simulators.vessel.voyage import Voyage, draw_voyage, run_stream

#: Channels of a recording, in order; the sensors in the configuration are named after them.
CHANNELS = (
    "Rudder Angle",
    "Surge Speed",
    "Sway Speed",
    "Yaw Rate",
    "Roll Angle",
    "Roll Rate",
)


def simulate_vessel(config: VesselSimulatorConfig, base_seed: int) -> Iterator[Recording]:
    """Yield every recording of the configured fleet, at 1 Hz, in a fixed order.

    The same configuration and seed give the same values; leaving runs out changes no other run.
    """
    yield from simulate_runs(plan_fleet(config), config, base_seed)


def simulate_runs(
    plans: Sequence[RunPlan], config: VesselSimulatorConfig, base_seed: int
) -> Iterator[Recording]:
    """Yield the recordings of these runs."""
    if not plans:
        return
    voyages = [draw_voyage(plan, config, base_seed) for plan in plans]
    logged = _sail(plans, voyages, config, base_seed)
    for run, (plan, voyage) in enumerate(zip(plans, voyages, strict=True)):
        values = _as_sensed(logged[:, :, run], config, run_stream(base_seed, plan, "sensors"))
        yield Recording(
            name=plan.name,
            info=_info(plan, voyage),
            time_s=np.arange(config.duration_s, dtype=np.float64),
            values=values,
            intervals=_intervals(plan, voyage),
        )


def _sail(
    plans: Sequence[RunPlan],
    voyages: Sequence[Voyage],
    config: VesselSimulatorConfig,
    base_seed: int,
) -> Array:
    """Return (sample, channel, run): what perfect sensors would log."""
    steps_per_s = round(1.0 / config.step_s)
    steps = (config.spin_up_s + config.duration_s) * steps_per_s
    time_s = np.arange(steps, dtype=np.float64) * config.step_s - config.spin_up_s
    hull = ferry(config.ferry, np.array([voyage.loading for voyage in voyages]))
    helm = _helm(plans, voyages, config, time_s, base_seed)
    conditions = Conditions(plans, voyages, config, hull, time_s, base_seed)
    state = _start_state(voyages, config)
    rpm = np.full(len(plans), config.ferry.rpm)
    logged = np.empty((config.duration_s, len(CHANNELS), len(plans)))
    for step, now_s in enumerate(time_s):
        order_deg = helm.order(step, now_s, state[3])
        current = conditions.current(step)
        if now_s >= 0 and step % steps_per_s == 0:
            logged[round(now_s)] = _log(state, order_deg, current, config)
        weather = conditions.forces(state, current, step)
        orders = Orders(np.deg2rad(order_deg), rpm)
        state = advance(hull, state, orders, current, weather, config.step_s)
    return logged


def _helm(
    plans: Sequence[RunPlan],
    voyages: Sequence[Voyage],
    config: VesselSimulatorConfig,
    time_s: Array,
    base_seed: int,
) -> Helm:
    schedule = [
        scheduled_angle(
            plan, voyage, config.maneuvers, time_s, run_stream(base_seed, plan, "steering")
        )
        for plan, voyage in zip(plans, voyages, strict=True)
    ]
    return Helm(
        schedule=np.stack(schedule, axis=-1),
        zigzag_deg=np.array(
            [float(plan.variant) if plan.maneuver == "zigzag" else 0.0 for plan in plans]
        ),
        side=np.array([voyage.side for voyage in voyages]),
        start_s=np.array([voyage.maneuver_start_s for voyage in voyages]),
    )


def _start_state(voyages: Sequence[Voyage], config: VesselSimulatorConfig) -> Array:
    """Upright, straight ahead and at full revolutions; the spin-up settles the rest."""
    state = np.zeros((len(STATE_ROWS), len(voyages)))
    state[3] = np.deg2rad([voyage.heading_deg for voyage in voyages])
    state[4] = [voyage.start_speed_m_s for voyage in voyages]
    state[9] = config.ferry.rpm
    return state


def _log(state: Array, order_deg: Array, current: Current, config: VesselSimulatorConfig) -> Array:
    """Return (channel, run); roll is logged positive with starboard down."""
    _, _, roll, heading, u, v, p, r, *_ = state
    if config.velocities == "through-water":
        along, across = current.in_body_axes(heading)
        u, v = u - along, v - across
    return np.stack([order_deg, u, v, np.rad2deg(r), -np.rad2deg(roll), -np.rad2deg(p)])


def _as_sensed(values: Array, config: VesselSimulatorConfig, stream: np.random.Generator) -> Array:
    """Add each sensor's noise to (sample, channel) and round to its resolution."""
    sensors = [config.sensors[channel] for channel in CHANNELS]
    noise = np.array([sensor.noise for sensor in sensors])
    resolution = np.array([sensor.resolution for sensor in sensors])
    noisy = values + noise * stream.standard_normal(values.shape)
    # Adding zero turns a negative zero into a positive one: "-0.000000" would be a second zero.
    return np.asarray(np.round(noisy / resolution) * resolution + 0.0)


def _intervals(plan: RunPlan, voyage: Voyage) -> tuple[Interval, ...]:
    if plan.disturbance == UNDISTURBED:
        return ()
    return (Interval(voyage.onset_s, voyage.end_s, plan.disturbance),)


def _info(plan: RunPlan, voyage: Voyage) -> RecordingInfo:
    return RecordingInfo(
        case="vessel",
        maneuver=plan.maneuver,
        variant=plan.variant,
        disturbance=plan.disturbance,
        components=plan.components,
        strength=plan.strength,
        base_seed=plan.seed_name,
        split=plan.split,
        extra={
            "weather": _weather_word(plan),
            "heading_deg": f"{voyage.heading_deg:.1f}",
            "loading": f"{voyage.loading:.3f}",
        },
    )


def _weather_word(plan: RunPlan) -> str:
    """Say what the weather is outside of an event."""
    return "light" if plan.light or plan.disturbance == "case-2" else "calm"
