"""Set every threshold, from calibration recordings that nothing else has seen."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_json
from odisar.capability.assessment import Thresholds, reported_windows
from odisar.capability.scoring import RecordingScores, Scorer
from odisar.capability.thresholds import sigma_threshold
from odisar.config.loader import ConfigView
from odisar.evaluation.alarms import calibrate_operating_threshold
from odisar.recordings.schema import Recording
from odisar.stages.detectors import detector_scores
from odisar.stages.members import Member, MemberData, hours, load_member, pipeline_members
from odisar.stages.parallel import run_jobs, show_progress
from odisar.tracking import TrackedRun
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device, use_one_thread

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    member: Member
    position: int


@dataclass(frozen=True)
class MemberCalibration:
    """What a member's calibration recordings say.

    ``runs`` holds, for a detector, the gapless score sequences by recording; ``sigma`` the
    mu + k sigma threshold of each detector; ``state_low`` and ``state_high`` (state,) the extremes
    of the forecast states in physical units.
    """

    runs: dict[str, list[tuple[str, NDArray[np.float64]]]]
    sigma: dict[str, float]
    thresholds: Thresholds
    state_low: list[float]
    state_high: list[float]
    hours: float
    test_clusters: frozenset[str]


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage."""
    jobs = [
        _Job(config, workspace.root, member, number % config.pipeline.workers)
        for number, member in enumerate(pipeline_members(config))
    ]
    calibrations = run_jobs(_calibrate, jobs, config.pipeline.workers)
    for setup in config.pipeline.setups:
        members = {
            job.member.name: calibration
            for job, calibration in zip(jobs, calibrations, strict=True)
            if job.member.setup == setup
        }
        content = setup_thresholds(config, setup, members)
        write_json(workspace.thresholds(setup), {"members": content})
        tracked.artifact(workspace.thresholds(setup))
        tracked.metrics(content)


def setup_thresholds(
    config: ConfigView, setup: str, members: dict[str, MemberCalibration]
) -> dict[str, dict[str, Any]]:
    """Return the thresholds of a set-up's members by name, operating points included.

    A member with fewer hours than ``pool_below_hours`` takes its operating point from the pooled
    out-of-fold scores of all folds, in units of each fold's own threshold. Folds whose calibration
    recordings are this member's test recordings stay out of its pool.
    """
    point = config.evaluation.operating_point
    states = config.case_of(setup).output_names
    content: dict[str, dict[str, Any]] = {}
    for name, member in members.items():
        pooled = member.hours < point.pool_below_hours and len(members) > 1
        pool = list(members.values()) if pooled else [member]
        operating = {
            detector: _operating_threshold(config, setup, detector, member, pool)
            for detector in member.sigma
        }
        content[name] = {
            "thresholds": asdict(member.thresholds),
            "sigma": member.sigma,
            "operating": operating,
            "operating_hours": sum(o.hours for o in pool if not _overlaps(o, member)),
            "operating_pooled": int(pooled),
            "calibration_hours": member.hours,
            "state_low": dict(zip(states, member.state_low, strict=True)),
            "state_high": dict(zip(states, member.state_high, strict=True)),
        }
    return content


def _operating_threshold(
    config: ConfigView,
    setup: str,
    detector: str,
    member: MemberCalibration,
    pool: list[MemberCalibration],
) -> float:
    case, point = config.case_of(setup), config.evaluation.operating_point
    runs = [
        (scores / other.sigma[detector], 1 / case.rate_hz)
        for other in pool
        if not _overlaps(other, member)
        for _, scores in other.runs[detector]
    ]
    rate = point.promised_per_hour * point.set_to_share_of_promise
    relative = calibrate_operating_threshold(runs, rate, case.persistence_s)
    return relative * member.sigma[detector]


def _overlaps(other: MemberCalibration, member: MemberCalibration) -> bool:
    if other is member:
        return False
    first = next(iter(other.runs.values()))
    return any(cluster in member.test_clusters for cluster, _ in first)


def _calibrate(job: _Job) -> MemberCalibration:
    use_one_thread()
    config, workspace = job.config, Workspace(job.root)
    data = load_member(config, workspace, job.member)
    twin = read_twin(workspace.twin(job.member.name))
    scorer = Scorer(twin, config.capability.scoring_batch, pick_device(config.pipeline.accelerator))
    calibration = data.splits["calibration"]
    shown = show_progress(calibration, job.member.name, job.position)
    scored = [scorer.score(item, short_lead_steps=data.case.short_lead_steps) for item in shown]
    runs = _score_runs(data, calibration, scored)
    sigma = {
        detector: sigma_threshold(
            np.concatenate([scores for _, scores in parts]), config.capability.threshold_sigmas
        )
        for detector, parts in runs.items()
    }
    sigma |= {rule.name: 1.0 for rule in data.case.range_rules}
    variances = np.concatenate(
        [
            scorer.variances(
                item, scores.positions[reported_windows(item, scores, twin.spec.horizon_steps)]
            )
            for item, scores in zip(calibration, scored, strict=True)
        ]
    )
    values = np.concatenate([item.values[:, data.case.output_indices] for item in calibration])
    return MemberCalibration(
        runs=runs,
        sigma=sigma,
        thresholds=Thresholds(
            sigma["odisar"], sigma_threshold(variances, config.capability.threshold_sigmas)
        ),
        state_low=values.min(axis=0).tolist(),
        state_high=values.max(axis=0).tolist(),
        hours=hours(calibration, data.case),
        test_clusters=frozenset(item.info.base_seed or item.name for item in data.splits["test"]),
    )


def _score_runs(
    data: MemberData, recordings: list[Recording], scored: list[RecordingScores]
) -> dict[str, list[tuple[str, NDArray[np.float64]]]]:
    runs: dict[str, list[tuple[str, NDArray[np.float64]]]] = {}
    for item, scores in zip(recordings, scored, strict=True):
        by_detector = detector_scores(data.case, item, scores)
        for start, stop in item.segments:
            inside = (scores.positions >= start) & (scores.positions < stop)
            for detector, values in by_detector.items():
                run = (item.info.base_seed or item.name, values[inside])
                runs.setdefault(detector, []).append(run)
    return runs
