"""Sections for the simulated robot: office, base, driving, odometry, disturbances, fleet."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import Fraction, NonNegativeFloat, PositiveFloat, PositiveInt, Section
from odisar.config.ranges import NonNegativeInt, Range, Share


class FurnitureConfig(Section):
    """Desks, cabinets and plants: sizes [m], how many, and what they keep free."""

    per_room: Range
    length_m: Range
    depth_m: Range
    gap_m: PositiveFloat
    door_gap_m: PositiveFloat


class OfficeConfig(Section):
    """An office floor: two long corridors, cross corridors, and rooms between and beside them."""

    width_m: PositiveFloat
    height_m: PositiveFloat
    resolution_m: PositiveFloat
    wall_m: PositiveFloat
    corridor_m: PositiveFloat
    side_room_depth_m: PositiveFloat
    room_width_m: Range
    cross_corridors: PositiveInt
    door_m: Range
    inner_door_share: Share
    furniture: FurnitureConfig

    @model_validator(mode="after")
    def _check(self) -> Self:
        middle_m = self.height_m - 2.0 * (self.side_room_depth_m + self.corridor_m)
        if middle_m < 2.0:
            raise ValueError(
                f"office: side rooms and corridors leave {middle_m:g} m for the rooms in the "
                "middle; lower side_room_depth_m or corridor_m, or raise height_m"
            )
        if self.room_width_m.low < self.door_m.high + 1.0:
            raise ValueError("office: room_width_m.low must exceed door_m.high by a metre or more")
        if self.wall_m < 2.0 * self.resolution_m:
            raise ValueError("office: wall_m must be two cells (resolution_m) or more")
        return self


class BaseConfig(Section):
    """The base: its footprint and its four mecanum wheels.

    ``scale_error_sd`` are relative errors of the wheels' calibration ahead, aside and in yaw, one
    draw a task: what makes odometry drift. ``encoder_counts`` are counts a wheel turn.
    """

    length_m: PositiveFloat
    width_m: PositiveFloat
    wheel_radius_m: PositiveFloat
    wheel_reach_m: PositiveFloat
    encoder_counts: PositiveInt
    scale_error_sd: Annotated[list[NonNegativeFloat], Field(min_length=3, max_length=3)]


class PlannerConfig(Section):
    """Shortest paths that prefer room, and their smoothing."""

    cell_m: PositiveFloat
    clearance_m: PositiveFloat
    comfort_m: PositiveFloat
    closeness_cost: NonNegativeFloat
    point_m: PositiveFloat
    smoothing_rounds: NonNegativeInt


class DriveConfig(Section):
    """The controller and the limits it keeps; ``ripple`` is the wheels' uneven speed.

    ``braking_share`` is the part of the acceleration limit that planned speeds use, so that the
    controller has the rest for correcting.
    """

    step_s: PositiveFloat
    cruise_m_s: Range
    yaw_rate_rad_s: PositiveFloat
    acceleration_m_s2: PositiveFloat
    yaw_acceleration_rad_s2: PositiveFloat
    lateral_acceleration_m_s2: PositiveFloat
    braking_share: Fraction
    narrow_share: Share
    lag_s: PositiveFloat
    lookahead_m: PositiveFloat
    goal_tolerance_m: PositiveFloat
    goal_tolerance_rad: PositiveFloat
    goal_heading_share: Share
    ripple: Share
    ripple_s: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.lag_s < self.step_s:
            raise ValueError(f"drive: lag_s={self.lag_s} must not be below step_s={self.step_s}")
        if self.cruise_m_s.low <= 0:
            raise ValueError(f"drive: cruise_m_s.low={self.cruise_m_s.low} must be above 0")
        return self


class TaskConfig(Section):
    """A task: waypoints apart from each other and from walls, a stop at each."""

    waypoints: Annotated[int, Field(ge=2)]
    separation_m: PositiveFloat
    clearance_m: PositiveFloat
    start_s: Range
    stand_s: Range
    duration_s: Range
    attempts: PositiveInt


class OdometryConfig(Section):
    """How wheels are read and odometry is stamped; see ``simulators.robot.odometry``."""

    rate_hz: PositiveFloat
    reads_per_sample: PositiveInt
    read_jitter_s: NonNegativeFloat
    velocity_window_s: PositiveFloat
    stamp_jitter_s: NonNegativeFloat
    stamp_jitter_limit_s: NonNegativeFloat
    late_share: Share
    late_s: Range

    @model_validator(mode="after")
    def _check(self) -> Self:
        worst_s = self.late_s.high + 2.0 * self.stamp_jitter_limit_s
        if self.late_s.low < 0 or worst_s >= 0.5 / self.rate_hz:
            raise ValueError(
                f"odometry: late_s.high + 2 stamp_jitter_limit_s = {worst_s:g} must stay below "
                "half a period, and late_s.low must not be negative: steps shorter than half a "
                "period or longer than one and a half would be errors in a recording"
            )
        return self


class RangesConfig(Section):
    """Two lidars merged into sectors: reach, rays in each sector, white noise."""

    max_m: PositiveFloat
    rays_per_sector: PositiveInt
    noise_m: NonNegativeFloat


class DisturbanceUnit(Section):
    """What strength 1 is, by kind of channel."""

    position_m: PositiveFloat
    yaw_rad: PositiveFloat
    velocity_m_s: PositiveFloat
    yaw_rate_rad_s: PositiveFloat


class SlipConfig(Section):
    """A slippery round patch of floor: what strength 1 takes from the motion and adds aside."""

    radius_m: PositiveFloat
    loss: Fraction
    pull_m_s: NonNegativeFloat
    turn_rad_s: NonNegativeFloat


class BlockedConfig(Section):
    """A blocked passage: where it's seen, where the base stops, how long it stands to replan."""

    passage_m: PositiveFloat
    half_length_m: PositiveFloat
    half_depth_m: PositiveFloat
    sight_m: PositiveFloat
    stop_m: PositiveFloat
    approach_m_s: PositiveFloat
    stand_s: Range
    clear_m: PositiveFloat
    detour_m: Range

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.stop_m >= self.sight_m:
            raise ValueError("blocked: stop_m must be below sight_m; the base can't stop unseeing")
        return self


class PeopleConfig(Section):
    """People who step into the way, linger and walk on."""

    crossings: Range
    radius_m: PositiveFloat
    walk_m_s: Range
    linger_s: Range
    reach_m: PositiveFloat
    trigger_m: Range
    slow_m: PositiveFloat
    stop_m: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.stop_m >= self.slow_m:
            raise ValueError("people: stop_m must be below slow_m; lower stop_m")
        if self.crossings.low < 1 or self.walk_m_s.low <= 0:
            raise ValueError("people: crossings.low must be 1 or more and walk_m_s.low above 0")
        return self


class RobotDisturbances(Section):
    """What can disturb a task, all after its first waypoint.

    Events in the odometry last ``duration_s``; at least ``quiet_s`` without disturbance follow any
    event. ``correlation_s`` is the time constant of the correlated noise.
    """

    unit: DisturbanceUnit
    duration_s: PositiveFloat
    quiet_s: PositiveFloat
    correlation_s: PositiveFloat
    slip: SlipConfig
    blocked: BlockedConfig
    people: PeopleConfig


RobotDisturbance = Literal[
    "noise", "correlated-noise", "bias", "drift", "slip", "blocked", "people"
]

#: Disturbances without a strength: they're there or not.
WITHOUT_STRENGTH = ("blocked", "people")


class DisturbedTasks(Section):
    """How many tasks, and each task's strengths; none for a disturbance without a strength."""

    tasks: NonNegativeInt
    strengths: list[PositiveFloat]


class RobotFleetConfig(Section):
    """Which tasks are made: undisturbed ones by split, disturbed ones by split and kind."""

    clean: dict[
        Literal["train", "validation", "calibration", "development", "test"], NonNegativeInt
    ]
    disturbed: dict[Literal["development", "test"], dict[RobotDisturbance, DisturbedTasks]]

    @model_validator(mode="after")
    def _check(self) -> Self:
        for split, kinds in self.disturbed.items():
            for kind, tasks in kinds.items():
                if (kind in WITHOUT_STRENGTH) and tasks.strengths:
                    raise ValueError(
                        f"fleet.disturbed.{split}.{kind} has no strength; write strengths: []"
                    )
                if kind not in WITHOUT_STRENGTH and tasks.tasks and not tasks.strengths:
                    raise ValueError(f"fleet.disturbed.{split}.{kind} needs strengths, or tasks: 0")
        return self


class RobotSimulatorConfig(Section):
    """The simulated robot, whole."""

    office: OfficeConfig
    base: BaseConfig
    planner: PlannerConfig
    drive: DriveConfig
    task: TaskConfig
    odometry: OdometryConfig
    ranges: RangesConfig
    disturbances: RobotDisturbances
    fleet: RobotFleetConfig

    @model_validator(mode="after")
    def _check(self) -> Self:
        half_diagonal_m = 0.5 * (self.base.length_m**2 + self.base.width_m**2) ** 0.5
        if self.task.clearance_m < half_diagonal_m:
            raise ValueError(
                f"task.clearance_m={self.task.clearance_m} is below half the base's diagonal, "
                f"{half_diagonal_m:.3f} m: it couldn't turn at a waypoint; raise it"
            )
        if self.planner.clearance_m < 0.5 * self.base.width_m:
            raise ValueError(
                f"planner.clearance_m={self.planner.clearance_m} is below half of base.width_m; "
                "paths would touch the walls; raise it"
            )
        if self.office.door_m.low < 2.0 * self.planner.clearance_m + self.planner.cell_m:
            raise ValueError(
                f"office.door_m.low={self.office.door_m.low} leaves no planner cell free between "
                "its posts; raise it, or lower planner.clearance_m or planner.cell_m"
            )
        if self.task.duration_s.low < self.disturbances.duration_s + self.disturbances.quiet_s:
            raise ValueError(
                "task.duration_s.low must be above disturbances.duration_s + quiet_s; raise it"
            )
        return self
