"""Dropout rate and number of draws: what they do to confidence, intervals and quadrants."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_table
from odisar.capability.distribution import disjoint_positions
from odisar.capability.scores import predictive_variance
from odisar.capability.scoring import Scorer
from odisar.capability.thresholds import sigma_threshold
from odisar.config.loader import ConfigView
from odisar.evaluation.metrics import auroc
from odisar.evaluation.reliability import reliability_table
from odisar.recordings.schema import Recording, label_times
from odisar.seeding import derive_seed
from odisar.stages.distributions import Distributions, Drawn, draw_with_truth
from odisar.stages.members import Member, MemberData, load_member
from odisar.stages.parallel import run_jobs
from odisar.study.trainings import Variant, variant_twin
from odisar.twin.devices import pick_device, use_one_thread

PARAMS = (
    "seed",
    "pipeline",
    "setups",
    "cases",
    "monte_carlo",
    "twin",
    "training",
    "capability",
    "evaluation",
    "study",
)

#: Every so many recordings of calibration and test: shares and coverages need no more.
_CALIBRATION_STRIDE, _TEST_STRIDE = 3, 9
#: A third of the epochs is enough to compare rates by; all have the same.
_EPOCHS_SHARE = 1 / 3
_SHOWN = ("coverage-0.95", "miscalibration", "sharpness", "crps")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    setup: str
    rate: float


def run(config: ConfigView, workspace: Workspace, setup: str) -> None:
    """Train a twin for each rate and write what its variance says, by number of draws."""
    jobs = [_Job(config, workspace.root, setup, rate) for rate in config.study.dropout]
    rows = run_jobs(_rate_rows, jobs, config.pipeline.workers)
    table = pd.DataFrame([row for part in rows for row in part])
    write_table(workspace.study_results / f"dropout-{setup}.csv", table)


def _rate_rows(job: _Job) -> list[dict[str, object]]:
    use_one_thread()
    config, workspace = job.config, Workspace(job.root)
    data = load_member(config, workspace, Member(job.setup, None))
    most = max(config.study.draws)
    variant = Variant(f"dropout-{job.rate:g}", None, job.rate, most, _EPOCHS_SHARE)
    twin = variant_twin(config, workspace, job.setup, data, variant)
    scorer = Scorer(twin, config.capability.scoring_batch, pick_device(config.pipeline.accelerator))
    calibration = data.splits["calibration"][::_CALIBRATION_STRIDE]
    test = data.splits["test"][::_TEST_STRIDE]
    drawn = {
        name: [_draw(scorer, data, item) for item in items]
        for name, items in (
            ("validation", data.splits["validation"]),
            ("calibration", calibration),
            ("test", test),
        )
    }
    disturbed = np.concatenate([_labels(data, item) for item in test])
    rows = []
    for draws in config.study.draws:
        fewer = {name: [(d[:draws], t) for d, t in parts] for name, parts in drawn.items()}
        rows.append(
            {
                "setup": job.setup,
                "dropout": job.rate,
                "draws": draws,
                **_uncertainty(fewer, disturbed, config.capability.threshold_sigmas),
                **_reliability(config, job.setup, data, fewer, test),
            }
        )
    return rows


def _draw(scorer: Scorer, data: MemberData, item: Recording) -> Drawn:
    return draw_with_truth(scorer, data, item, disjoint_positions(item, data.spec))


def _labels(data: MemberData, item: Recording) -> NDArray[np.bool_]:
    positions = disjoint_positions(item, data.spec)
    return label_times(item.time_s[positions], item.intervals)


def _uncertainty(
    drawn: dict[str, list[Drawn]], disturbed: NDArray[np.bool_], sigmas: float
) -> dict[str, object]:
    """Return how often the variance is above its threshold, and how well it ranks."""
    variance = {
        name: np.concatenate([predictive_variance(draws) for draws, _ in parts])
        for name, parts in drawn.items()
    }
    threshold = sigma_threshold(variance["calibration"], sigmas)
    uncertain = variance["test"] > threshold
    return {
        "variance_threshold": threshold,
        "uncertain_of_undisturbed": _share(uncertain[~disturbed]),
        "uncertain_of_disturbed": _share(uncertain[disturbed]),
        "auroc_of_variance": auroc(variance["test"].astype(np.float64), disturbed),
        "windows": len(uncertain),
    }


def _share(flags: NDArray[np.bool_]) -> float:
    return float(flags.mean()) if len(flags) else float("nan")


def _reliability(
    config: ConfigView,
    setup: str,
    data: MemberData,
    drawn: dict[str, list[Drawn]],
    test: list[Recording],
) -> dict[str, object]:
    """Return how far intervals can be trusted on undisturbed test recordings, pooled states."""
    fitted = Distributions.fit(drawn["validation"], drawn["calibration"])
    forecasts = [
        fitted.forecasts(item, one)
        for item, one in zip(test, drawn["test"], strict=True)
        if not item.info.is_disturbed
    ]
    seed = derive_seed(config.seed, "bootstrap", config.setups[setup].case)
    table = reliability_table(setup, forecasts, data.case.output_names, config.evaluation, seed)
    pooled = table[(table.state == "all") & table.metric.isin(_SHOWN)]
    return {
        f"{row['distribution']}.{row['metric']}": row["value"] for row in pooled.to_dict("records")
    }
