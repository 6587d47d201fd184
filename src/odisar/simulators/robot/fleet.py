"""The fleet: which tasks exist, what their recordings are called, and which share a seed."""

from collections.abc import Iterator
from dataclasses import dataclass

from odisar.config.robot import WITHOUT_STRENGTH, RobotFleetConfig
from odisar.recordings.schema import UNDISTURBED

#: Components of a recording with a disturbance.
ALL_COMPONENTS = "all"

_SPLITS_WITH_DISTURBED = ("development", "test")


@dataclass(frozen=True)
class TaskPlan:
    """One task to drive; every strength makes a recording of it.

    ``seed_name`` names its streams of random numbers and its cluster. A disturbance without a
    strength has the one strength None.
    """

    seed_name: str
    split: str
    disturbance: str = UNDISTURBED
    strengths: tuple[float | None, ...] = (None,)

    @property
    def recordings(self) -> list[tuple[str, float | None]]:
        """Names of the task's recordings, each with its strength."""
        return [
            (self.seed_name if strength is None else f"{self.seed_name}-s{strength:g}", strength)
            for strength in self.strengths
        ]


def plan_fleet(config: RobotFleetConfig) -> list[TaskPlan]:
    """Return every task of the configuration, always in the same order, each name once."""
    return [*_clean_tasks(config), *_disturbed_tasks(config)]


def _clean_tasks(config: RobotFleetConfig) -> Iterator[TaskPlan]:
    for split, count in config.clean.items():
        kind = "clean-" if split in _SPLITS_WITH_DISTURBED else ""
        for number in range(1, count + 1):
            yield TaskPlan(f"{split}-{kind}{number:03d}", split)


def _disturbed_tasks(config: RobotFleetConfig) -> Iterator[TaskPlan]:
    for split, kinds in config.disturbed.items():
        for kind, tasks in kinds.items():
            strengths = (None,) if kind in WITHOUT_STRENGTH else tuple(tasks.strengths)
            for number in range(1, tasks.tasks + 1):
                yield TaskPlan(f"{split}-{kind}-{number:02d}", split, kind, strengths)
