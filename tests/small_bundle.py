"""A bundle of the small system: its case, its settings, and tables of its samples."""

from pathlib import Path

import numpy as np
import pandas as pd

from odisar.capability.assessment import Assessment, Capability, Thresholds
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scoring import DETECTORS, Scorer
from odisar.config.cases import Case
from odisar.deployment.bundle import write_bundle
from odisar.deployment.deployed import CapabilitySettings, Example, ThresholdValues
from odisar.deployment.development import DevelopmentScore
from odisar.deployment.manifest import Origin
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from small_innovations import fit_small_scores
from small_system import CHANNELS, SCORE, SPEC, make_recording

MAX_ROWS = 2000


def small_case(**changes: object) -> Case:
    """Return the case of the small system."""
    roles = ("command", "state", "state")
    channels = [
        {
            "name": name,
            "unit": "m/s",
            "role": role,
            "output": role == "state",
            "known_ahead": False,
            "min": -20.0,
            "max": 20.0,
        }
        for name, role in zip(CHANNELS, roles, strict=True)
    ]
    values = {
        "title": "A small system",
        "source": {
            "folder": "data/system",
            "maker": "none",
            "time_column": "time_s",
            "max_recordings": 100,
            "csv": {"separator": "comma", "decimal": "point"},
            "bag": None,
            "resample": "none",
        },
        "rate_hz": 1.0,
        "max_gap_s": 1.5,
        "channels": channels,
        "pose": None,
        "window": {"context_steps": SPEC.context_steps, "horizon_steps": SPEC.horizon_steps},
        "splits": {
            "kind": "metadata",
            "fractions": None,
            "folds": None,
            "block_s": None,
            "block_gap_s": None,
        },
        "score": SCORE,
        "persistence_s": 3.0,
        "short_lead_s": 3.0,
        "guard_start_s": 5.0,
        "guard_end_s": 10.0,
        "groups": {"overall": {}, "group_by": [], "apart": [], "with_clean": []},
        "faults": None,
        "range_rules": [],
    }
    return Case.model_validate(values | changes)


def small_settings(twin: TrainedTwin, **changes: object) -> CapabilitySettings:
    """Return settings whose thresholds tell the small system's pushes apart."""
    sigma = dict(zip(DETECTORS, (4.0, 4.0, 4.0, 4.0, 0.2, 1.0, 0.8), strict=True))
    values = {
        "innovation": InnovationScoreValues.of(fit_small_scores(twin)),
        "thresholds": ThresholdValues(score=4.0, reconstruction=0.2, variance=0.02),
        "threshold_sigmas": 3.0,
        "sigma": sigma,
        "operating": {name: 1.2 * value for name, value in sigma.items()},
        "operating_pooled": False,
        "calibration_hours": 0.5,
        "attribution_top": 2,
        "report_stride_steps": SPEC.horizon_steps,
        "scoring_batch": 64,
        "max_rows": MAX_ROWS,
    }
    return CapabilitySettings.model_validate(values | changes)


def table_of(recording: Recording, *, named: bool = False) -> pd.DataFrame:
    """Return a recording's samples as anyone would have them."""
    table = pd.DataFrame(recording.values, columns=list(CHANNELS))
    table.insert(0, "time_s", recording.time_s)
    if named:
        table["recording"] = recording.name
    return table


def small_example() -> Example:
    """Return 41 samples: a window, those until the first score, and one more."""
    table = table_of(make_recording("example", 41))
    return Example(columns=list(table.columns), data=table.to_numpy().tolist())


def write_small_bundle(
    folder: Path, twin: TrainedTwin, case: Case | None = None, **origin: object
) -> Path:
    """Write a bundle and return its folder."""
    about = {"setup": "small", "case": "system", "member": "small", "members": 1, "content": "k1"}
    write_bundle(
        folder,
        twin,
        case or small_case(),
        small_settings(twin),
        Origin.model_validate(about | origin),
        small_example(),
    )
    return folder


def expected(twin: TrainedTwin, recording: Recording) -> list[Assessment]:
    """Return what the pipeline's own objects say of a recording."""
    settings = small_settings(twin)
    scorer = Scorer(twin, settings.scoring_batch, "cpu", settings.innovation.build())
    thresholds = Thresholds(**settings.thresholds.model_dump())
    capability = Capability(scorer, thresholds, attribution_top=settings.attribution_top)
    scores = scorer.score(recording, short_lead_steps=3)
    return capability.assess(
        recording, scores, stride_steps=settings.report_stride_steps, step_s=1.0
    )


def development_score(auroc: float | None = 0.9, measured_on: str = "a") -> DevelopmentScore:
    """Return a score as the bundle stage would have measured it."""
    low, high = (None, None) if auroc is None else (auroc - 0.05, min(1.0, auroc + 0.05))
    return DevelopmentScore(auroc, low, high, 12, 3000, measured_on)


def pushed(name: str = "pushed", samples: int = 300) -> Recording:
    """Return a recording with a disturbance that shows."""
    recording = make_recording(name, samples, push=0.2)
    assert np.ptp(recording.values[:, 1]) > 0.1
    return recording
