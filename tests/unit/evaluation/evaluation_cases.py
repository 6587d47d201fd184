"""Small scored recordings for the tests of this room."""

import numpy as np

from odisar.config.cases import Groups
from odisar.config.judging import Judging, OperatingPoint
from odisar.evaluation.scored import ScoredRecording
from odisar.recordings.schema import Interval, RecordingInfo

CONFIG = Judging(
    guard_start_s=60.0,
    guard_end_s=120.0,
    consequence_s=6.0,
    short_lead_s=10.0,
    bootstrap_draws=200,
    bootstrap_bins=100,
    confidence=0.95,
    operating_point=OperatingPoint(
        promised_per_hour=1.0, set_to_share_of_promise=0.5, pool_below_hours=6.0
    ),
)

GROUPS = Groups(
    overall={"components": ["all"]},
    group_by=["disturbance", "maneuver"],
    apart=["components"],
    with_clean=[],
)


def scored(
    time_s,
    scores,
    event=None,
    *,
    name="r",
    info=None,
    horizon=60,
    context=60,
    step_s=1.0,
    threshold=1.0,
    operating=1.0,
    consequence_s=None,
):
    """Return a scored recording; ``event`` is (onset, end) or None."""
    disturbance = "case-1" if event else "none"
    components = "all" if event else "none"
    strength = 1.0 if event else None
    return ScoredRecording(
        name=name,
        info=info or RecordingInfo("vessel", "zigzag", "", disturbance, components, strength, name),
        intervals=(Interval(*event, "storm"),) if event else (),
        time_s=np.asarray(time_s, dtype=float),
        scores={key: np.asarray(value, dtype=float) for key, value in scores.items()},
        thresholds=dict.fromkeys(scores, threshold),
        operating_thresholds=dict.fromkeys(scores, operating),
        first_consequence_s=consequence_s,
        horizon_steps=horizon,
        context_steps=context,
        step_s=step_s,
    )


def vessel_test_set(seed=0, repeats=2):
    """Return recordings like the vessel's: two manoeuvres, two cases, two strengths, and clean."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(59.0, 1200.0)
    recordings = []
    for maneuver in ("zigzag", "turning"):
        for k in range(repeats):
            cluster = f"{maneuver}-{k}"
            kinds = [("none", "none", None)]
            kinds += [(c, "all", s) for c in ("case-1", "case-2") for s in (0.5, 1.0)]
            kinds += [("case-1", "wind", 0.5)]
            for disturbance, components, strength in kinds:
                onset, end = 420 + rng.integers(-60, 61), 840 + rng.integers(-60, 61)
                event = (float(onset), float(end)) if strength else None
                active = (time_s >= onset) & (time_s < end) & (strength is not None)
                scores = {
                    d: np.abs(rng.normal(size=len(time_s))) + 2 * (strength or 0) * active
                    for d in ("odisar", "rmse")
                }
                scores["rmse"][:60] = np.nan
                recordings.append(
                    scored(
                        time_s,
                        scores,
                        event,
                        name=f"{cluster}-{disturbance}-{components}-{strength}",
                        info=RecordingInfo(
                            "vessel", maneuver, "", disturbance, components, strength, cluster
                        ),
                        threshold=2.0,
                        operating=2.0,
                        consequence_s=float(onset + 90) if event else None,
                    )
                )
    return recordings
