"""Fit every alternative that the default run leaves out, and score calibration and test with it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from odisar.artifacts import Workspace, write_json
from odisar.baselines.interface import Detector
from odisar.baselines.neural.registry import NOT_DEPLOYABLE, neural_detectors
from odisar.baselines.registry import optional_detectors
from odisar.capability.dropout_variance import DropoutVariance
from odisar.config.loader import ConfigView
from odisar.fitting import FitBudget
from odisar.stages.detectors import member_reference
from odisar.stages.members import Member, load_member
from odisar.stages.parallel import run_jobs
from odisar.study.places import alternatives_folder
from odisar.study.rescored import judge_scores, read_judged, write_judged
from odisar.twin.bundle import TrainedTwin, read_twin
from odisar.twin.devices import use_one_thread

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation", "study")

DROPOUT_VARIANCE = "dropout-variance"

#: Detectors that share a fit are one job.
_PAIRS = (("ensemble-variance", "ensemble-reconstruction"), NOT_DEPLOYABLE)


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    setup: str
    names: tuple[str, ...]


def all_alternatives(
    config: ConfigView, twin: TrainedTwin, share: float = 1.0
) -> dict[str, Callable[[], Detector]]:
    """Return what makes each alternative of the study, by name.

    Networks are trained for a ``share`` of their steps. ``twin`` is the pipeline's; the variance of
    its draws is left out where it must know commands ahead.
    """
    optional: dict[str, Callable[[], Detector]] = {
        name: lambda name=name: optional_detectors()[name]  # type: ignore[misc]
        for name in optional_detectors()
    }
    budget = FitBudget(**config.study.detectors.model_dump())
    own: dict[str, Callable[[], Detector]] = {DROPOUT_VARIANCE: lambda: DropoutVariance(twin)}
    networks = neural_detectors(budget.part(share))
    return optional | networks | ({} if twin.spec.known_ahead else own)


def run(config: ConfigView, workspace: Workspace, setup: str) -> None:
    """Fit and score; what a killed run has finished is not done again."""
    paired = {name for pair in _PAIRS for name in pair}
    twin = read_twin(workspace.twin(setup))
    groups = [(name,) for name in all_alternatives(config, twin) if name not in paired]
    jobs = [_Job(config, workspace.root, setup, names) for names in [*_PAIRS, *groups]]
    run_jobs(_score, jobs, config.pipeline.workers)
    judged = read_judged(alternatives_folder(workspace, setup))
    limits = {n: {"sigma": j.sigma, "operating": j.operating} for n, j in judged.items()}
    write_json(workspace.study / f"alternatives-{setup}.json", limits)


def _score(job: _Job) -> None:
    use_one_thread()
    workspace, config = Workspace(job.root), job.config
    folder = alternatives_folder(workspace, job.setup)
    if set(job.names) <= set(_finished(folder)):
        return
    data = load_member(config, workspace, Member(job.setup, None))
    reference = member_reference(data, config.seed)
    made = all_alternatives(config, read_twin(workspace.twin(job.setup)))
    found = {}
    for name in job.names:
        detector = made[name]()
        detector.fit(reference)
        calibration = detector.score(data.splits["calibration"])
        test = detector.score(data.splits["test"])
        found[name] = judge_scores(config, data, calibration, test)
    write_judged(folder, found)


def _finished(folder: Path) -> Mapping[str, object]:
    return read_judged(folder) if folder.is_dir() else {}
