"""Another draw of the test recordings, made when everything was settled and scored once.

Test recordings are looked at again with every change; what comes of that is no longer a test. The
simulators' random numbers go by a run's name, so the same runs under other names have other
weather, manoeuvres, tasks and faults, of the same distributions, in the same office.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd

from odisar.artifacts import Workspace, read_json, read_table, write_table
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scoring import Scorer
from odisar.config.cases import Case
from odisar.config.judging import Judging
from odisar.config.loader import ConfigView
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import DETECTION_COLUMNS, detection_table
from odisar.recordings.quality import raise_on_errors
from odisar.recordings.reader import read_case
from odisar.recordings.schema import Recording
from odisar.recordings.writer import write_recordings
from odisar.seeding import derive_seed
from odisar.simulators.robot import fleet as robot_fleet
from odisar.simulators.robot.runs import simulate_tasks
from odisar.simulators.vessel import fleet as vessel_fleet
from odisar.simulators.vessel.runs import simulate_runs
from odisar.stages.detectors import MemberDetectors
from odisar.stages.members import Member, MemberData, load_member
from odisar.study.places import study_folder
from odisar.study.rescored import scored_recording
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device

PARAMS = (
    "seed",
    "pipeline",
    "setups",
    "cases",
    "capability",
    "evaluation",
    "simulators",
    "study",
)

_KEYS = ["setup", "evaluated_on", "strength", "protocol", "detector", "metric"]
_COLUMNS = [name for name in DETECTION_COLUMNS if name != "published"]


def run(config: ConfigView, workspace: Workspace, setup: str) -> None:
    """Write what every detector has on the second draw, beside what it has on test recordings.

    A case that no simulator makes has no second draw: its table is empty.
    """
    path = workspace.study_results / f"confirmation-{setup}.csv"
    data = load_member(config, workspace, Member(setup, None))
    drawn = second_draw(config, data.case)
    if drawn is None:
        print(f"{setup}: no simulator makes its recordings, so there is no second draw")  # noqa: T201
        write_table(path, pd.DataFrame(columns=[*_COLUMNS, "on_test"]))
        return
    name = config.setups[setup].case
    folder = study_folder(workspace) / "confirmation" / name
    recordings = as_read(drawn, name, data.case, folder, workspace.root)
    scored = _scored(config, workspace, setup, data, recordings)
    cfg = Judging.of(config.evaluation, data.case)
    seed = derive_seed(config.seed, "bootstrap", name)
    persistence = data.case.persistence_s
    table = detection_table({setup: scored}, data.case.groups, cfg, persistence, seed, {})
    test = read_table(workspace.results / "detection.csv").rename(columns={"value": "on_test"})
    beside = table[_COLUMNS].merge(test[[*_KEYS, "on_test"]], on=_KEYS, how="left")
    write_table(path, beside[beside.protocol == "P2"])


def second_draw(config: ConfigView, case: Case) -> Iterator[Recording] | None:
    """Return the test recordings of a simulated case, drawn again; None for any other case."""
    simulators = config.simulators
    if case.source.maker == "ferry-simulator":
        runs = [
            replace(plan, name=_again(plan.name), seed_name=_again(plan.seed_name))
            for plan in vessel_fleet.plan_fleet(simulators.vessel)
            if plan.split == "test"
        ]
        return simulate_runs(runs, simulators.vessel, simulators.seed)
    if case.source.maker == "robot-simulator":
        tasks = [
            replace(plan, seed_name=_again(plan.seed_name))
            for plan in robot_fleet.plan_fleet(simulators.robot.fleet)
            if plan.split == "test"
        ]
        return simulate_tasks(tasks, simulators.robot, simulators.seed, case.channel_names)
    return None


def as_read(
    drawn: Iterator[Recording], case_name: str, case: Case, folder: Path, root: Path
) -> list[Recording]:
    """Return recordings as the pipeline would have them: written to files, read and checked."""
    write_recordings(folder, drawn, case.channel_names)
    source = case.source.model_copy(update={"folder": folder.relative_to(root).as_posix()})
    found = read_case(case_name, case.model_copy(update={"source": source}), root)
    raise_on_errors(found.findings)
    return found.recordings


def _again(name: str) -> str:
    return f"again-{name}"


def _scored(
    config: ConfigView,
    workspace: Workspace,
    setup: str,
    data: MemberData,
    recordings: list[Recording],
) -> list[ScoredRecording]:
    """Score recordings by every detector as the pipeline has calibrated it."""
    limits = read_json(workspace.thresholds(setup))["members"][setup]
    scorer = Scorer(
        read_twin(workspace.twin(setup)),
        config.capability.scoring_batch,
        pick_device(config.pipeline.accelerator),
        InnovationScoreValues.model_validate(limits["innovation"]).build(),
    )
    detectors = MemberDetectors.fit(data, scorer, config.seed)
    scored = []
    for item in recordings:
        scores, by_detector = detectors.score(item)
        at = item.time_s[scores.positions]
        scored.append(scored_recording(config, item, data, limits, at, by_detector))
    return scored
