"""Put each set-up's calibrated twin into a bundle, and measure it on development recordings."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from odisar.artifacts import Workspace, read_json, write_json
from odisar.capability.combined import InnovationScores
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scoring import Scorer
from odisar.config.cases import Case
from odisar.config.loader import ConfigView
from odisar.deployment.bundle import read_bundle, write_bundle
from odisar.deployment.deployed import CapabilitySettings, Deployed, Example, ThresholdValues
from odisar.deployment.development import DevelopmentScore, measure
from odisar.deployment.manifest import Origin, first_problem
from odisar.deployment.samples import recordings_from_table
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from odisar.seeding import derive_seed
from odisar.stages.members import Member, MemberData, load_member, setup_members
from odisar.stages.parallel import run_jobs
from odisar.tracking import TrackedRun
from odisar.twin.bundle import TrainedTwin, read_twin
from odisar.twin.devices import pick_device, use_one_thread

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation", "registry")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    member: Member


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage. Of a cross-fitted set-up, the first fold's twin is bundled."""
    jobs = [
        _Job(config, workspace.root, setup_members(config, setup)[0])
        for setup in config.pipeline.setups
    ]
    scores = run_jobs(_bundle, jobs, config.pipeline.workers)
    content = {job.member.setup: asdict(s) for job, s in zip(jobs, scores, strict=True)}
    write_json(workspace.development, content)
    tracked.artifact(workspace.development)
    for setup, score in content.items():
        if score["auroc"] is not None:
            tracked.metrics({f"{setup}.development.auroc": score["auroc"]})


def measure_again(
    config: ConfigView, workspace: Workspace, setup: str, deployed: Deployed
) -> DevelopmentScore:
    """Measure an earlier bundle of a set-up on today's development recordings.

    Raises OdisarError where its channels, their units, its rate or its pose are not those of
    today's case.
    """
    today, its = _measured_in(config.case_of(setup)), _measured_in(deployed.case)
    for what, then in its.items():
        if then != today[what]:
            raise OdisarError(f"its {what} {then}, today's {today[what]}")
    use_one_thread()
    member = setup_members(config, setup)[0]
    scores = deployed.settings.innovation.build()
    data = load_member(config, workspace, member)
    return _measure(config, member, data, deployed.twin, scores)


def _measured_in(case: Case) -> dict[str, str]:
    """Return, by words for each, what two cases must share for one twin to take both's samples."""
    pose = case.pose
    return {
        "channels are": ", ".join(case.channel_names),
        "units are": ", ".join(channel.unit for channel in case.channels),
        "rate_hz is": f"{case.rate_hz!r}",
        "pose is": "none" if pose is None else f"{', '.join(pose.channels)} ({pose.coordinates})",
    }


def _bundle(job: _Job) -> DevelopmentScore:
    use_one_thread()
    config, workspace, member = job.config, Workspace(job.root), job.member
    case_name = config.setups[member.setup].case
    case = config.cases[case_name]
    limits = read_json(workspace.thresholds(member.setup))["members"][member.name]
    twin = read_twin(workspace.twin(member.name))
    origin = Origin(
        setup=member.setup,
        case=case_name,
        member=member.name,
        members=len(setup_members(config, member.setup)),
        content=_inputs_key([workspace.twin(member.name), workspace.thresholds(member.setup)]),
    )
    settings = _settings(config, limits, twin.spec.horizon_steps)
    data = load_member(config, workspace, member)
    # A score is known once so many innovations are; relative poses have no increment at first.
    surplus = settings.innovation.build().known_after_steps + 1
    example = _example(data.splits["calibration"], case_name, case, surplus)
    folder = workspace.bundle(member.setup)
    write_bundle(folder, twin, case, settings, origin, example)
    deployed = read_bundle(folder)
    deployed.assess(deployed.example)
    return _measure(config, member, data, twin, settings.innovation.build())


def _measure(
    config: ConfigView,
    member: Member,
    data: MemberData,
    twin: TrainedTwin,
    innovation_scores: InnovationScores,
) -> DevelopmentScore:
    device = pick_device(config.pipeline.accelerator)
    return measure(
        Scorer(twin, config.capability.scoring_batch, device, innovation_scores),
        data.case,
        data.splits["development"],
        config.evaluation,
        stride_steps=config.registry.development_stride_steps,
        seed=derive_seed(config.seed, "bundle", member.name),
    )


def _settings(config: ConfigView, limits: dict[str, Any], stride_steps: int) -> CapabilitySettings:
    try:
        return CapabilitySettings(
            innovation=InnovationScoreValues.model_validate(limits["innovation"]),
            thresholds=ThresholdValues(**limits["thresholds"]),
            threshold_sigmas=config.capability.threshold_sigmas,
            sigma=limits["sigma"],
            operating=limits["operating"],
            operating_pooled=bool(limits["operating_pooled"]),
            calibration_hours=limits["calibration_hours"],
            attribution_top=config.capability.attribution_top,
            report_stride_steps=stride_steps,
            scoring_batch=config.capability.scoring_batch,
            max_rows=config.registry.max_rows,
        )
    except ValidationError as error:
        raise OdisarError(
            f"what was calibrated can't be deployed: {first_problem(error)}; look at the "
            "calibration recordings, and run the calibrate stage again"
        ) from error


def _example(
    recordings: Sequence[Recording], case_name: str, case: Case, surplus_steps: int
) -> Example:
    """Return the first stretch of a calibration recording that is accepted as a table.

    It has ``surplus_steps`` more samples than a window.
    """
    for example in _stretches(recordings, case, surplus_steps):
        try:
            table = example.table
            recordings_from_table(table, case_name, case, len(table))
        except OdisarError:
            continue
        return example
    raise OdisarError(
        f"case {case_name!r}: no stretch of a calibration recording is sound enough for an example "
        "(a state that never changes, say); add calibration recordings"
    )


def _stretches(
    recordings: Sequence[Recording], case: Case, surplus_steps: int
) -> Iterator[Example]:
    needed = case.window.context_steps + case.window.horizon_steps + surplus_steps
    columns = [case.source.time_column, *case.channel_names]
    for item in recordings:
        for begin, end in item.segments:
            for start in range(begin, end - needed + 1, case.window.horizon_steps):
                rows = slice(start, start + needed)
                data = np.column_stack([item.time_s[rows], item.values[rows]])
                yield Example(columns=columns, data=data.tolist())


def _inputs_key(paths: Sequence[Path]) -> str:
    """Return a hash of the files a bundle is made from.

    Not the content key of the workspace: that one also changes with code which has no part in the
    bundle, so the same recordings and parameters would no longer give the same bytes.
    """
    digest = hashlib.sha256()
    for path in paths:
        for file in sorted(path.iterdir()) if path.is_dir() else [path]:
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]
