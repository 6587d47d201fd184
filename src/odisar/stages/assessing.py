"""Score and assess a member's test recordings by every detector."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.artifacts import Workspace, read_json
from odisar.capability.assessment import Assessment, Capability, Thresholds
from odisar.capability.distribution import disjoint_positions
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scoring import Scorer
from odisar.config.cases import Case
from odisar.config.loader import ConfigView
from odisar.evaluation.blame import named_by_chance
from odisar.evaluation.cells import metadata_columns
from odisar.evaluation.forecasts import ForecastErrors
from odisar.evaluation.reliability import RecordingForecasts
from odisar.evaluation.scored import ScoredRecording
from odisar.recordings.schema import Recording, label_times
from odisar.stages.accuracy import member_accuracy
from odisar.stages.consequence import first_consequence
from odisar.stages.detectors import MemberDetectors
from odisar.stages.distributions import Distributions, draw_with_truth
from odisar.stages.leakage import member_leakage
from odisar.stages.members import Member, load_member
from odisar.stages.parallel import show_progress
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device, use_one_thread
from odisar.windows.nearness import nearness_table

#: Rules for a threshold, as ``calibrate`` names them, by their key in what it wrote.
RULES = {
    "sigma": "sigma",
    "log-sigma": "log_sigma",
    "operating": "operating",
    "conformal": "conformal",
}


@dataclass(frozen=True)
class Job:
    """A member to evaluate, and the row of its progress bar."""

    config: ConfigView
    root: Path
    member: Member
    position: int


@dataclass(frozen=True)
class MemberResult:
    """What came of a member's test recordings.

    ``thresholds`` and ``promises`` are by rule and detector; ``assessed`` and ``nearness`` are
    rows of the tables they are named after; ``forecasts`` are distributions of undisturbed ones,
    ``target_std`` (state,) what one scaled unit of them is in physical ones; ``accuracy`` is what
    the twin and simpler forecasters err by.
    """

    scored: list[ScoredRecording]
    thresholds: Mapping[str, Mapping[str, float]]
    promises: Mapping[str, Mapping[str, float]]
    assessments: list[Assessment]
    assessed: pd.DataFrame
    forecasts: list[RecordingForecasts]
    target_std: NDArray[np.float64]
    nearness: pd.DataFrame
    leakage: pd.DataFrame
    accuracy: list[ForecastErrors]

    @property
    def scores(self) -> pd.DataFrame:
        """All scores, a row for each recording and time."""
        frames = [
            pd.DataFrame({"recording": item.name, "time_s": item.time_s, **item.scores})
            for item in self.scored
        ]
        return pd.concat(frames, ignore_index=True)


class _Assessing:
    """One member's detectors and capability, and what has been found with them so far."""

    def __init__(self, job: Job) -> None:
        config, workspace, member = job.config, Workspace(job.root), job.member
        self.member = member
        self.data = load_member(config, workspace, member)
        self.limits = read_json(workspace.thresholds(member.setup))["members"][member.name]
        fitted = read_json(workspace.distribution(member.setup))["members"][member.name]
        self.distributions = Distributions.from_json(fitted)
        self.scorer = Scorer(
            read_twin(workspace.twin(member.name)),
            config.capability.scoring_batch,
            pick_device(config.pipeline.accelerator),
            InnovationScoreValues.model_validate(self.limits["innovation"]).build(),
        )
        self.detectors = MemberDetectors.fit(self.data, self.scorer, config.seed)
        self.capability = Capability(
            self.scorer,
            Thresholds(**self.limits["thresholds"]),
            attribution_top=config.capability.attribution_top,
        )
        self.consequence_s: float = config.evaluation.consequence_s
        self.scored: list[ScoredRecording] = []
        self.assessments: list[Assessment] = []
        self.rows: list[dict[str, object]] = []
        self.forecasts: list[RecordingForecasts] = []

    def take(self, item: Recording) -> None:
        """Score and assess one recording."""
        case, spec = self.data.case, self.data.spec
        step_s = 1 / case.rate_hz
        scores, by_detector = self.detectors.score(item)
        self.scored.append(
            ScoredRecording(
                name=item.name,
                info=item.info,
                intervals=item.intervals,
                time_s=item.time_s[scores.positions],
                scores=by_detector,
                thresholds=self.limits["sigma"],
                operating_thresholds=self.limits["operating"],
                first_consequence_s=first_consequence(item, case, self.limits, self.consequence_s),
                horizon_steps=spec.horizon_steps,
                context_steps=spec.context_steps,
                step_s=step_s,
            )
        )
        made = self.capability.assess(item, scores, stride_steps=spec.horizon_steps, step_s=step_s)
        self.assessments.extend(made)
        self.rows.extend(_assessed_row(self.member.setup, item, case, one) for one in made)
        if not item.info.is_disturbed:
            positions = disjoint_positions(item, spec)
            drawn = draw_with_truth(self.scorer, self.data, item, positions)
            self.forecasts.append(self.distributions.forecasts(item, drawn))


def evaluate_member(job: Job) -> MemberResult:
    """Score, assess and probe one member."""
    use_one_thread()
    found = _Assessing(job)
    data, limits, config = found.data, found.limits, job.config
    for item in show_progress(data.splits["test"], job.member.name, job.position):
        found.take(item)
    promised = config.evaluation.operating_point.promised_per_hour
    leakage = member_leakage(data, found.detectors, config.seed)
    return MemberResult(
        scored=found.scored,
        thresholds={rule: limits[key] for rule, key in RULES.items()},
        promises={
            "operating": dict.fromkeys(limits["sigma"], promised),
            "conformal": limits["promised_per_hour"],
        },
        assessments=found.assessments,
        assessed=pd.DataFrame(found.rows),
        forecasts=found.forecasts,
        target_std=data.scaler.target_std,
        nearness=nearness_table(job.member.name, data.splits, data.scaler, data.spec),
        leakage=leakage.assign(setup=job.member.setup, member=job.member.name),
        accuracy=member_accuracy(data, found.scorer),
    )


def _assessed_row(
    setup: str, item: Recording, case: Case, assessment: Assessment
) -> dict[str, object]:
    info, guilty = item.info, _guilty(item, case)
    issued = item.time_s[[assessment.start_time_step - 1]]
    return {
        "setup": setup,
        "recording": item.name,
        "base_seed": info.base_seed or item.name,
        **{column: info.column(column) for column in metadata_columns(case.groups)},
        "strength": info.strength,
        "is_disturbed": bool(label_times(issued, item.intervals)[0]),
        "category": assessment.category,
        **_named("state", assessment.state_attribution),
        **_named("rebuilt_state", assessment.reconstruction_attribution),
        "fault": info.column("fault") or f"{info.disturbance} {info.column('strength')}".strip(),
        "guilty": guilty,
        "state_chance": named_by_chance(guilty, case.blamed_names),
        "rebuilt_state_chance": named_by_chance(guilty, case.output_names),
    }


def _named(prefix: str, attribution: Mapping[str, float]) -> dict[str, str]:
    states = [*attribution, "", "", ""][:3]
    return {f"{prefix}_{i + 1}": state for i, state in enumerate(states)}


def _guilty(item: Recording, case: Case) -> str:
    """Return the channel that a fault was put on: ours, or the first word of what was logged."""
    named = item.info.column("fault_channel") or item.info.column("detail").partition(" ")[0]
    return named if named in case.channel_names else ""
