"""The fleet: which runs exist, what each is called, and which of them share a seed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product

from odisar.config.simulators import (
    ComponentRuns,
    DisturbedRuns,
    Maneuver,
    ManeuversConfig,
    VesselSimulatorConfig,
)
from odisar.recordings.schema import UNDISTURBED

#: Components of a run in which the case disturbs all that it can.
ALL_COMPONENTS = "all"


@dataclass(frozen=True)
class RunPlan:
    """One run to make.

    ``seed_name`` names the streams of random numbers: runs that share it have the same heading,
    timing, steering, gusts and waves, and differ only in what the disturbance adds. ``light`` says
    whether an undisturbed run has light weather.
    """

    name: str
    seed_name: str
    split: str
    maneuver: str
    variant: str
    disturbance: str = UNDISTURBED
    components: str = UNDISTURBED
    strength: float | None = None
    light: bool = False


def plan_fleet(config: VesselSimulatorConfig) -> list[RunPlan]:
    """Return every run of the configuration, always in the same order, each name once."""
    return [*_clean_runs(config), *_disturbed_runs(config)]


def variants(maneuvers: ManeuversConfig) -> Iterator[tuple[Maneuver, str]]:
    """Yield every manoeuvre with each of its variants."""
    for angle in maneuvers.zigzag_deg:
        yield "zigzag", str(angle)
    for angle in maneuvers.turning_deg:
        yield "turning", str(angle)
    for name in maneuvers.random:
        yield "random", name


def _clean_runs(config: VesselSimulatorConfig) -> Iterator[RunPlan]:
    for split, counts in config.fleet.clean.items():
        for maneuver, variant in variants(config.maneuvers):
            for replicate in range(1, counts.get(maneuver, 0) + 1):
                kind = "clean-" if split == "test" else ""
                name = f"{split}-{maneuver}-{variant}-{kind}{replicate}"
                light = _is_light(replicate, config.environment.light_share)
                yield RunPlan(name, name, split, maneuver, variant, light=light)


def _is_light(replicate: int, share: float) -> bool:
    """Spread light weather evenly over the replicates, so that each variant gets its share."""
    return int(replicate * share) > int((replicate - 1) * share)


def _disturbed_runs(config: VesselSimulatorConfig) -> Iterator[RunPlan]:
    """Yield the runs in which all is disturbed, then those in which one component is."""
    for split, whole in config.fleet.disturbed.items():
        yield from _event_runs(config, split, whole, {ALL_COMPONENTS: ""})
    for split, parts in config.fleet.one_component.items():
        named: dict[str, str] = {name: f"-{name}" for name in parts.components}
        yield from _event_runs(config, split, parts, named)


def _event_runs(
    config: VesselSimulatorConfig,
    split: str,
    runs: DisturbedRuns | ComponentRuns,
    components: Mapping[str, str],
) -> Iterator[RunPlan]:
    """Yield every variant in every case; ``components`` map each to what names say of it."""
    for (maneuver, variant), case in product(variants(config.maneuvers), runs.cases):
        seed_name = f"{split}-{maneuver}-{variant}-{case}"
        for (component, part), strength in product(components.items(), runs.strengths):
            yield RunPlan(
                name=f"{seed_name}{part}-s{strength:g}",
                seed_name=seed_name,
                split=split,
                maneuver=maneuver,
                variant=variant,
                disturbance=case,
                components=component,
                strength=strength,
            )
