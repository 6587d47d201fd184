"""Write the golden files beside this script: numbers that only a wanted change may move.

Run it when ``test_golden.py`` fails and the change behind the failure is wanted: another table
metric, another ferry (or other values under ``simulators`` in params.yaml), another network. Look
at the difference before you commit it, and say in the commit why the numbers moved::

    PYTHONPATH=src .venv/bin/python tests/golden/make_golden.py
    git diff tests/golden

Nothing here draws from torch's random numbers: inputs and weights are sines and cosines.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from odisar.capability.assessment import Capability, Thresholds, assessments_json
from odisar.capability.combined import (
    CLOSED_FORM,
    ODISAR,
    WITHOUT_TRANSFORMER,
    InnovationScores,
    MeanParts,
)
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import (
    InnovationLimit,
    InnovationScore,
    InnovationSize,
    LogScale,
    MeanInnovation,
)
from odisar.capability.outliers import NoiseSteps, SensorNoise
from odisar.capability.release import Release
from odisar.capability.scoring import RECONSTRUCTION, Scorer
from odisar.capability.shifts import ShiftSteps, StateShift
from odisar.config.cases import Groups
from odisar.config.judging import Judging, OperatingPoint
from odisar.config.learning import TwinConfig
from odisar.config.loader import load_config
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import detection_table
from odisar.forecasters.closed_form import design_width
from odisar.recordings.schema import Interval, Recording, RecordingInfo
from odisar.simulators.vessel.fleet import RunPlan
from odisar.simulators.vessel.runs import CHANNELS, simulate_runs
from odisar.twin.bundle import TrainedTwin
from odisar.twin.layers import Dropout
from odisar.twin.transformer import TwinTransformer
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec

HERE = Path(__file__).resolve().parent
DETECTION, FERRY, TWIN = HERE / "detection.csv", HERE / "ferry.csv", HERE / "twin.json"
DECIMALS = 8
#: Some windows of the golden twin are above it, some below.
SCORE_LIMIT = 2.0

JUDGING = Judging(
    guard_start_s=5.0,
    guard_end_s=10.0,
    consequence_s=3.0,
    short_lead_s=2.0,
    bootstrap_draws=50,
    bootstrap_bins=40,
    confidence=0.9,
    operating_point=OperatingPoint(
        promised_per_hour=30.0, set_to_share_of_promise=0.5, pool_below_hours=1.0
    ),
)
GROUPS = Groups(overall={"components": ["all"]}, group_by=["disturbance"], apart=[], with_clean=[])


def detection() -> pd.DataFrame:
    """Return the detection table of six small recordings, two of them undisturbed."""
    events = [(20.0, 40.0), (30.0, 45.0), (15.0, 35.0), (25.0, 55.0), None, None]
    recordings = [_scored(number, event) for number, event in enumerate(events)]
    return detection_table({"tiny": recordings}, GROUPS, JUDGING, 2.0, 5, {"tiny": "vessel-all"})


def _scored(number: int, event: tuple[float, float] | None) -> ScoredRecording:
    time_s = np.arange(3.0, 70.0)
    on = np.zeros_like(time_s) if event is None else (time_s >= event[0]) & (time_s < event[1])
    wave = np.sin(0.7 * time_s + number) + 0.5 * np.cos(2.3 * time_s - number)
    scores = {"odisar": 1.5 + wave + 1.1 * on, "rmse": 1.2 - wave * (1 - 0.6 * on) + 0.9 * on}
    scores["rmse"][:4] = np.nan
    kind = "none" if event is None else f"case-{number // 2 + 1}"
    info = RecordingInfo(
        "vessel",
        disturbance=kind,
        components="none" if event is None else "all",
        strength=None if event is None else 1.0,
        base_seed=f"cluster-{number}",
    )
    return ScoredRecording(
        name=f"recording-{number}",
        info=info,
        intervals=() if event is None else (Interval(*event, kind),),
        time_s=time_s,
        scores=scores,
        thresholds={"odisar": 2.6, "rmse": 2.1},
        operating_thresholds={"odisar": 2.9, "rmse": 2.3},
        first_consequence_s=None if event is None else event[0] + 6.0,
        horizon_steps=4,
        context_steps=4,
        step_s=1.0,
    )


def ferry() -> pd.DataFrame:
    """Return every tenth sample of 120 s of a disturbed zigzag of the shipped ferry."""
    shipped = load_config(HERE.parents[1]).simulators
    event = shipped.vessel.event.model_copy(
        update={"onset_s": 30.0, "end_s": 90.0, "jitter_s": 5.0}
    )
    config = shipped.vessel.model_copy(update={"duration_s": 120, "event": event})
    plan = RunPlan("golden", "golden", "test", "zigzag", "20", "case-3", "all", 1.0)
    recording = next(simulate_runs([plan], config, 20251122))
    table = pd.DataFrame(recording.values, columns=list(CHANNELS))
    table.insert(0, "time_s", recording.time_s)
    table.insert(1, "disturbed", 0)
    for interval in recording.intervals:
        inside = (table.time_s >= interval.start_s) & (table.time_s < interval.end_s)
        table.loc[inside, "disturbed"] = 1
    return table[::10].reset_index(drop=True)


def twin() -> dict[str, Any]:
    """Return scores, innovations, variances and assessments of a twin whose weights are cosines."""
    made = cosine_twin()
    scorer = Scorer(made, 8, "cpu", analytic_scores())
    recording = _waves()
    scores = scorer.score(recording, short_lead_steps=4)
    limits = Thresholds(score=SCORE_LIMIT, reconstruction=0.888, variance=0.00085)
    capability = Capability(scorer, limits, attribution_top=2)
    assessments = capability.assess(recording, scores, stride_steps=10, step_s=0.5)
    first = scorer.innovation_scores.known_after_steps
    return {
        "score": scores.scores[ODISAR][first:].tolist(),
        "closed_form_score": scores.scores[CLOSED_FORM][first:].tolist(),
        "innovations": scores.innovations[1::10].tolist(),
        "reconstruction_error": scores.scores[RECONSTRUCTION].tolist(),
        "state_errors": scores.state_errors[::10].tolist(),
        "variance": scorer.variances(recording, scores.positions[::10]).tolist(),
        "assessments": json.loads(assessments_json(assessments)),
    }


def analytic_scores() -> InnovationScores:
    """Return innovation scores that were fitted on nothing."""
    limit = InnovationLimit(np.array([[1.2, 0.1], [0.1, 0.9]]), 0.7)
    mean = MeanInnovation(4, np.array([[2.0, 0.3], [0.3, 1.0]]), LogScale(-0.5, 1.5), limit)
    size = InnovationSize(2, np.array([[1.5, -0.2], [-0.2, 0.8]]), LogScale(-0.7, 0.9))
    newer = (
        MeanInnovation(2, np.array([[1.1, 0.2], [0.2, 0.6]]), LogScale(0.4, 2.6), limit),
        InnovationSize(1, np.array([[1.5, -0.2], [-0.2, 0.8]]), LogScale(-0.2, 1.9)),
    )
    recent = MeanInnovation(2, np.array([[0.9, 0.1], [0.1, 0.7]]), LogScale(-0.8, 1.9), None)
    parts = MeanParts(
        InnovationScore(mean, size, *newer, recent, 0.3, LogScale(-0.2, 0.1)),
        InnovationScore(mean, size, *newer, recent, 0.3, None),
        InnovationScore(mean, size, *newer, recent, 0.4, None),
        analytic_relations(),
        share_holding=0.5,
        scatter=None,
    )
    steps = NoiseSteps(lasting=3, recent=2, recent_share=0.5, margin=0.1)
    noise = SensorNoise(steps, LogScale(-0.5, 0.3), LogScale(-0.55, 0.35), LogScale(-0.6, 0.4))
    scales = {
        ODISAR: LogScale(-0.3, 1.2),
        WITHOUT_TRANSFORMER: LogScale(-0.4, 1.3),
        CLOSED_FORM: LogScale(-0.2, 1.1),
    }
    shift = StateShift(ShiftSteps(memory=9, margin=0.2), LogScale(0.0, 1.3), LogScale(0.1, 1.2))
    return InnovationScores(parts, noise, shift, scales, Release(steps=6, share=0.5))


def analytic_relations() -> Consistency:
    """Return relations of a command and two states: each state from the two other features."""
    weights = np.zeros((2, design_width(3, 1)))
    weights[0, [0, 2]] = 0.3, -0.4
    weights[1, [0, 1]] = -0.2, 0.5
    return Consistency((1, 2), weights)


def cosine_twin() -> TrainedTwin:
    """Return a twin of two layers with analytic weights and dropout masks."""
    config = TwinConfig(
        patch_steps=5,
        model_dim=16,
        heads=2,
        layers=2,
        feedforward_dim=24,
        reconstruction_dim=12,
        dropout=0.1,
        detach_reconstruction=False,
        closed_form_lags=5,
        residual_forecast=False,
    )
    spec = WindowSpec(
        context_steps=20, horizon_steps=10, outputs=(1, 2), commands=(0,), known_ahead=()
    )
    network = TwinTransformer(config, spec, channels=3)
    with torch.no_grad():
        for number, weight in enumerate(network.parameters()):
            ramp = torch.arange(weight.numel(), dtype=torch.float64)
            weight.copy_((0.3 * torch.cos(0.9 * ramp + 0.1 * number**2)).view_as(weight))
        for number, buffer in enumerate(network.buffers()):
            ramp = torch.arange(buffer.numel(), dtype=torch.float64)
            buffer.copy_((0.1 + 0.08 * torch.sin(0.7 * ramp + number)).view_as(buffer))
    masks = {
        name: _mask(4, site.tokens, site.features)
        for name, site in network.named_modules()
        if isinstance(site, Dropout)
    }
    scaler = Scaler(
        np.array([0.0, 2.0, -1.0]),
        np.array([10.0, 0.5, 1.5]),
        np.array([2.0, -1.0]),
        np.array([0.5, 1.5]),
    )
    names = ("Rudder", "Speed", "Turn Rate")
    return TrainedTwin(network.eval(), config, spec, scaler, masks, names)


def _mask(draws: int, tokens: int, features: int) -> torch.Tensor:
    places = torch.arange(draws * tokens * features).view(draws, tokens, features)
    return ((places * 7) % 11 != 0).to(torch.uint8)


def _waves() -> Recording:
    time_s = np.arange(70) * 0.5
    values = np.column_stack(
        [
            10 * np.sign(np.sin(0.4 * time_s)),
            2 + 0.5 * np.sin(0.3 * time_s) + 0.02 * time_s,
            -1 + 1.5 * np.cos(0.5 * time_s) * (1 + 0.05 * time_s),
        ]
    )
    return Recording("waves", RecordingInfo("tiny"), time_s, values)


def write() -> None:
    """Write all golden files."""
    detection().round(DECIMALS).to_csv(DETECTION, index=False, lineterminator="\n")
    ferry().to_csv(FERRY, index=False, float_format="%.4f", lineterminator="\n")
    TWIN.write_text(json.dumps(_rounded(twin()), indent=1) + "\n", encoding="utf-8")


def _rounded(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _rounded(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_rounded(value) for value in content]
    return round(content, DECIMALS) if isinstance(content, float) else content


if __name__ == "__main__":
    write()
