"""Members: the twins of a set-up, one, or one for each fold where a case is cross-fitted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from odisar.artifacts import Workspace
from odisar.config.cases import Case
from odisar.config.loader import ConfigView
from odisar.recordings.faults import inject_faults
from odisar.recordings.schema import Recording
from odisar.recordings.splits import assign_splits
from odisar.recordings.store import read_store
from odisar.seeding import derive_seed
from odisar.windows.coordinates import pose_channels
from odisar.windows.scaling import Scaler, channel_std
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec


@dataclass(frozen=True)
class Member:
    """One twin to train: a set-up, and the fold it leaves out if the case is cross-fitted."""

    setup: str
    fold: int | None

    @property
    def name(self) -> str:
        """Name of the member in paths and seeds."""
        return self.setup if self.fold is None else f"{self.setup}.fold-{self.fold}"


@dataclass(frozen=True)
class MemberData:
    """What a member may look at: its recordings by split, and the scaling of its training ones."""

    case: Case
    splits: dict[str, list[Recording]]
    scaler: Scaler
    spec: WindowSpec

    def windows(self, split: str, *, stride_steps: int = 1) -> WindowSet:
        """Return the windows of a split's recordings."""
        return WindowSet(self.splits[split], self.scaler, self.spec, stride_steps=stride_steps)

    def knowing_commands(self, commands: tuple[int, ...]) -> "MemberData":
        """Return the same data with these commands, and no other, known over the horizon."""
        return replace(self, spec=replace(self.spec, known_ahead=commands))


def setup_members(config: ConfigView, setup: str) -> list[Member]:
    """Return the members of a set-up."""
    splits = config.case_of(setup).splits
    if splits.kind != "cross-fit":
        return [Member(setup, None)]
    return [Member(setup, fold) for fold in range(splits.folds)]


def pipeline_members(config: ConfigView) -> list[Member]:
    """Return the members of every set-up of the pipeline."""
    return [member for setup in config.pipeline.setups for member in setup_members(config, setup)]


def load_member(config: ConfigView, workspace: Workspace, member: Member) -> MemberData:
    """Read a member's recordings, divide them, fit the scaling on the training ones.

    Where the case declares faults, faulty copies of the clean test recordings join the test split.
    """
    setup = config.setups[member.setup]
    case = config.cases[setup.case]
    recordings = read_store(workspace.recordings(setup.case))
    splits = assign_splits(
        recordings, case, setup.select, member.fold, derive_seed(config.seed, "splits", setup.case)
    )
    if case.faults is not None:
        seed = derive_seed(config.seed, "faults", setup.case)
        std = channel_std(splits["train"])
        splits["test"] = splits["test"] + inject_faults(splits["test"], case, std, seed)
    spec = WindowSpec(
        case.window.context_steps,
        case.window.horizon_steps,
        tuple(case.output_indices),
        tuple(case.command_indices),
        tuple(case.known_ahead_indices),
        pose_channels(case),
    )
    return MemberData(case, splits, Scaler.fit(splits["train"], spec), spec)


def hours(recordings: Sequence[Recording], case: Case) -> float:
    """Return the recorded time of some recordings in hours."""
    return sum(len(recording.time_s) for recording in recordings) / case.rate_hz / 3600.0
