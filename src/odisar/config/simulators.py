"""Sections for the simulators: the ferry, its weather, its manoeuvres and the fleet of runs."""

import hashlib
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import Fraction, NonNegativeFloat, PositiveFloat, PositiveInt, Section
from odisar.config.ranges import NonNegativeInt, Share
from odisar.config.ranges import Range as Range  # noqa: PLC0414 (the ferry imports it here)
from odisar.config.robot import RobotSimulatorConfig

Angle = Annotated[int, Field(gt=0, le=90)]


class WindageConfig(Section):
    """Areas above water and coefficients of quadratic wind forces."""

    lateral_area_m2: PositiveFloat
    frontal_area_m2: PositiveFloat
    surge_coefficient: PositiveFloat
    sway_coefficient: PositiveFloat
    yaw_coefficient: NonNegativeFloat
    centre_above_gravity_m: PositiveFloat


class FerryConfig(Section):
    """Particulars of the ferry; hydrodynamic coefficients come from R/V Gunnerus."""

    length_m: PositiveFloat
    beam_m: PositiveFloat
    draught_m: PositiveFloat
    block_coefficient: Fraction
    kg_m: PositiveFloat
    gm_m: PositiveFloat
    roll_gyration: Fraction
    yaw_gyration: Fraction
    roll_damping_ratio: Fraction
    cross_flow_drag: PositiveFloat
    service_speed_kn: PositiveFloat
    rpm: PositiveFloat
    thrust_n_per_rpm2: PositiveFloat
    bow_thruster: Literal["mirrored", "locked"]
    thruster_reach: Annotated[float, Field(gt=0, le=0.5)]
    thruster_below_keel_m: NonNegativeFloat
    foil_forward_m2: NonNegativeFloat
    foil_aft_m2: NonNegativeFloat
    azimuth_rate_deg_s: PositiveFloat
    azimuth_lag_s: PositiveFloat
    windage: WindageConfig


class Sensor(Section):
    """Standard deviation of a channel's white noise, and the step its value is rounded to."""

    noise: NonNegativeFloat
    resolution: PositiveFloat


class RandomSteering(Section):
    """One random variant: angles drawn up to ``max_angle_deg``, each held for a drawn time."""

    max_angle_deg: PositiveFloat
    hold_s: Range

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.hold_s.low <= 0:
            raise ValueError(f"hold_s.low={self.hold_s.low} must be above 0")
        return self


class ManeuversConfig(Section):
    """Manoeuvres and their variants, and what varies from run to run."""

    zigzag_deg: list[Angle]
    turning_deg: list[Angle]
    random: dict[str, RandomSteering]
    start_s: Range
    start_speed_m_s: Range
    loading: Range


class WavesConfig(Section):
    """A JONSWAP sea whose peak period follows its height, as where the fetch is limited."""

    components: Annotated[int, Field(ge=20)]
    peak_enhancement: PositiveFloat
    peak_period_s_per_sqrt_m: PositiveFloat
    spreading_deg: NonNegativeFloat
    lateral_drift: Share
    yaw_drift_lever: NonNegativeFloat


class GustsConfig(Section):
    """A Davenport gust spectrum along the wind, and a weaker one across it."""

    components: Annotated[int, Field(ge=20)]
    surface_drag: PositiveFloat
    lateral_share: Share


class LevelRange(Section):
    """Normal light weather between ``low`` and ``edge``; ``full`` is the published disturbance."""

    low: NonNegativeFloat
    edge: PositiveFloat
    full: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.low <= self.edge < self.full:
            raise ValueError(
                f"levels must rise: low={self.low}, edge={self.edge}, full={self.full}; a full "
                "disturbance at or below the edge would be normal weather"
            )
        return self


class EnvironmentConfig(Section):
    """Wind, waves and current: their levels, where they come from, and how fast they change."""

    wind_kn: LevelRange
    waves_m: LevelRange
    current_kn: LevelRange
    wind_from_deg: float
    waves_from_deg: float
    current_from_deg: float
    light_share: Share
    speed_rate_kn_min: Range
    wave_rate_m_min: PositiveFloat
    direction_rate_deg_min: PositiveFloat
    gusts: GustsConfig
    waves: WavesConfig


class EventConfig(Section):
    """When the disturbance comes and goes, and by how much both times vary."""

    onset_s: PositiveFloat
    end_s: PositiveFloat
    jitter_s: NonNegativeFloat


Maneuver = Literal["zigzag", "turning", "random"]
DisturbedSplit = Literal["development", "test"]
CleanSplit = Literal["train", "validation", "calibration", "test"]
DisturbanceCase = Literal["case-1", "case-2", "case-3"]
Component = Literal["wind", "waves", "current"]


class DisturbedRuns(Section):
    """Disturbed runs of one split: every case at every strength, for every variant."""

    cases: list[DisturbanceCase]
    strengths: list[Share]


class ComponentRuns(Section):
    """Runs of one split in which only one part of the weather is disturbed."""

    components: list[Component]
    cases: list[DisturbanceCase]
    strengths: list[Share]


class FleetConfig(Section):
    """Which runs are made.

    ``clean`` counts undisturbed runs a variant, by split and manoeuvre. Test runs start on
    headings in the even sectors of ``heading_sector_deg`` and development runs in the odd ones.
    """

    clean: dict[CleanSplit, dict[Maneuver, NonNegativeInt]]
    disturbed: dict[DisturbedSplit, DisturbedRuns]
    one_component: dict[DisturbedSplit, ComponentRuns]
    heading_sector_deg: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        sectors = 360.0 / self.heading_sector_deg
        if sectors != round(sectors) or round(sectors) % 2:
            raise ValueError(
                f"heading_sector_deg={self.heading_sector_deg} must divide the circle into an "
                "even number of sectors, so that even and odd ones alternate all the way round"
            )
        return self


class VesselSimulatorConfig(Section):
    """The simulated ferry: how runs are integrated, logged and put together."""

    step_s: PositiveFloat
    duration_s: PositiveInt
    spin_up_s: PositiveInt
    velocities: Literal["over-ground", "through-water"]
    ferry: FerryConfig
    sensors: dict[str, Sensor]
    maneuvers: ManeuversConfig
    environment: EnvironmentConfig
    event: EventConfig
    fleet: FleetConfig

    @model_validator(mode="after")
    def _check(self) -> Self:
        steps = 1.0 / self.step_s
        if steps != round(steps):
            raise ValueError(f"step_s={self.step_s} must divide the sampling period of 1 s")
        last_end = self.event.end_s + self.event.jitter_s
        if last_end > self.duration_s:
            raise ValueError(
                f"event: end_s + jitter_s = {last_end} lies after duration_s={self.duration_s}"
            )
        if self.event.end_s - self.event.onset_s <= 2.0 * self.event.jitter_s:
            raise ValueError("event: end_s - onset_s must be more than twice jitter_s")
        return self


Simulator = Literal["vessel", "robot"]


class SimulatorsConfig(Section):
    """All simulators."""

    seed: Annotated[int, Field(ge=0)]
    vessel: VesselSimulatorConfig
    robot: RobotSimulatorConfig

    def recipe(self, simulator: Simulator, channel_names: Sequence[str]) -> str:
        """Return the hash of everything that decides a simulator's recordings but the code."""
        decisive = [self.model_dump_json(include={"seed", simulator}), *channel_names]
        return hashlib.sha256("\n".join(decisive).encode()).hexdigest()
