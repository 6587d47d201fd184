"""Set every threshold, from calibration recordings that nothing else has seen."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_json
from odisar.capability.assessment import reported_windows
from odisar.capability.combined import ODISAR
from odisar.capability.distribution import disjoint_positions
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scores import predictive_variance
from odisar.capability.scoring import RECONSTRUCTION, RecordingScores, Scorer
from odisar.capability.thresholds import (
    CalibrationRun,
    ConformalThreshold,
    conformal_threshold,
    log_sigma_threshold,
    longest_shared_block_s,
    sigma_threshold,
)
from odisar.config.cases import Case
from odisar.config.loader import ConfigView
from odisar.evaluation.alarms import calibrate_operating_threshold
from odisar.recordings.schema import Recording
from odisar.stages.detectors import RULE_THRESHOLD, MemberDetectors, fit_innovation_scores
from odisar.stages.distributions import Distributions, draw_with_truth
from odisar.stages.members import Member, hours, load_member, pipeline_members
from odisar.stages.parallel import run_jobs, show_progress
from odisar.tracking import TrackedRun
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device, use_one_thread

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation")

#: Of what is written down, covariances and words are no metrics.
_NO_METRICS = ("innovation", "promise")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    member: Member
    position: int


@dataclass(frozen=True)
class MemberCalibration:
    """What a member's calibration recordings say.

    ``innovation`` is the fitted score; ``runs`` holds, for a detector, the gapless score sequences
    by recording; ``sigma`` and ``log_sigma`` are the mu + k sigma thresholds of each detector, of
    scores and of their logs; ``variance`` is that of the Monte Carlo variance; ``distributions``
    are what makes calibrated intervals of its draws; ``state_low`` and
    ``state_high`` (state,) are the extremes of the forecast states in physical units.
    """

    innovation: InnovationScoreValues
    runs: dict[str, list[tuple[str, NDArray[np.float64]]]]
    sigma: dict[str, float]
    log_sigma: dict[str, float]
    variance: float
    distributions: Distributions
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
        fitted = {name: member.distributions.as_json() for name, member in members.items()}
        write_json(workspace.distribution(setup), {"members": fitted})
        tracked.metrics(
            {
                name: {k: v for k, v in found.items() if k not in _NO_METRICS}
                for name, found in content.items()
            }
        )


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
        conformal = {
            detector: _conformal_threshold(config, setup, detector, member, pool)
            for detector in member.sigma
        }
        by_rule = {
            "sigma": member.sigma,
            "log-sigma": member.log_sigma,
            "operating": operating,
            "conformal": {detector: found.threshold for detector, found in conformal.items()},
        }
        content[name] = {
            "innovation": member.innovation.model_dump(),
            "thresholds": {
                "score": by_rule[config.capability.threshold_rule][ODISAR],
                "reconstruction": member.sigma[RECONSTRUCTION],
                "variance": member.variance,
            },
            **{rule.replace("-", "_"): found for rule, found in by_rule.items()},
            "promise": conformal[ODISAR].promise,
            "promised_per_hour": {d: found.promised_per_hour for d, found in conformal.items()},
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
    runs = [(scores, spacing_s) for _, scores, spacing_s in _pooled(case, detector, member, pool)]
    rate = point.promised_per_hour * point.set_to_share_of_promise
    relative = calibrate_operating_threshold(runs, rate, case.persistence_s)
    return relative * member.sigma[detector]


def _conformal_threshold(
    config: ConfigView,
    setup: str,
    detector: str,
    member: MemberCalibration,
    pool: list[MemberCalibration],
) -> ConformalThreshold:
    case, point = config.case_of(setup), config.evaluation.operating_point
    runs = _pooled(case, detector, member, pool)
    found = conformal_threshold(
        runs, point.promised_per_hour, case.persistence_s, longest_shared_block_s(runs)
    )
    return replace(found, threshold=found.threshold * member.sigma[detector])


def _pooled(
    case: Case, detector: str, member: MemberCalibration, pool: list[MemberCalibration]
) -> list[CalibrationRun]:
    """Return the runs of a pool in units of each one's own threshold."""
    return [
        (cluster, scores / other.sigma[detector], 1 / case.rate_hz)
        for other in pool
        if not _overlaps(other, member)
        for cluster, scores in other.runs[detector]
    ]


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
    batch, device = config.capability.scoring_batch, pick_device(config.pipeline.accelerator)
    innovation = fit_innovation_scores(Scorer(twin, batch, device), data)
    scorer = Scorer(twin, batch, device, innovation)
    detectors = MemberDetectors.fit(data, scorer, config.seed)
    calibration = data.splits["calibration"]
    shown = show_progress(calibration, job.member.name, job.position)
    scored = [detectors.score(item) for item in shown]
    runs = _score_runs(calibration, scored)
    rules = {rule.name: RULE_THRESHOLD for rule in data.case.range_rules}
    by_detector = {
        name: np.concatenate([part for _, part in parts]) for name, parts in runs.items()
    }
    sigmas = config.capability.threshold_sigmas
    stride = twin.spec.horizon_steps
    drawn = [
        draw_with_truth(scorer, data, item, scores.positions[reported_windows(scores, stride)])
        for item, (scores, _) in zip(calibration, scored, strict=True)
    ]
    held_out = [
        draw_with_truth(scorer, data, item, disjoint_positions(item, twin.spec))
        for item in data.splits["validation"]
    ]
    variances = [predictive_variance(draws) for draws, _ in drawn]
    values = np.concatenate([item.values[:, data.case.output_indices] for item in calibration])
    return MemberCalibration(
        innovation=InnovationScoreValues.of(innovation),
        runs=runs,
        sigma={d: sigma_threshold(scores, sigmas) for d, scores in by_detector.items()} | rules,
        log_sigma={d: log_sigma_threshold(s, sigmas) for d, s in by_detector.items()} | rules,
        variance=sigma_threshold(np.concatenate(variances), sigmas),
        distributions=Distributions.fit(held_out, drawn),
        state_low=values.min(axis=0).tolist(),
        state_high=values.max(axis=0).tolist(),
        hours=hours(calibration, data.case),
        test_clusters=frozenset(item.info.base_seed or item.name for item in data.splits["test"]),
    )


def _score_runs(
    recordings: list[Recording],
    scored: list[tuple[RecordingScores, dict[str, NDArray[np.float64]]]],
) -> dict[str, list[tuple[str, NDArray[np.float64]]]]:
    runs: dict[str, list[tuple[str, NDArray[np.float64]]]] = {}
    for item, (scores, by_detector) in zip(recordings, scored, strict=True):
        for start, stop in scores.runs:
            for detector, values in by_detector.items():
                run = (item.info.base_seed or item.name, values[start:stop])
                runs.setdefault(detector, []).append(run)
    return runs
