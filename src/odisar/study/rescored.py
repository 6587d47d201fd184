"""Scored test recordings from what `evaluate` and the study's alternatives have written."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.artifacts import Workspace, read_json
from odisar.capability.thresholds import sigma_threshold
from odisar.config.loader import ConfigView
from odisar.errors import OdisarError
from odisar.evaluation.alarms import calibrate_operating_threshold
from odisar.evaluation.scored import ScoredRecording
from odisar.recordings.schema import Recording
from odisar.stages.consequence import first_consequence
from odisar.stages.members import MemberData

#: (sample,) scores of a recording.
Scores = NDArray[np.float64]


def read_scored(
    config: ConfigView, workspace: Workspace, setup: str, data: MemberData
) -> list[ScoredRecording]:
    """Return a set-up's scored test recordings as `evaluate` left them."""
    limits = read_json(workspace.thresholds(setup))["members"][setup]
    try:
        table = pd.read_parquet(workspace.scores(setup))
    except (OSError, ValueError) as error:
        raise OdisarError(f"{workspace.scores(setup)}: cannot be read ({error})") from error
    by_name = {item.name: item for item in data.splits["test"]}
    detectors = [name for name in table.columns if name not in ("recording", "time_s")]
    return [
        scored_recording(config, by_name[str(name)], data, limits, part["time_s"].to_numpy(),
                {d: part[d].to_numpy() for d in detectors})
        for name, part in table.groupby("recording", sort=False)
    ]  # fmt: skip


def scored_recording(
    config: ConfigView,
    item: Recording,
    data: MemberData,
    limits: Mapping[str, Any],
    time_s: NDArray[np.float64],
    scores: Mapping[str, Scores],
) -> ScoredRecording:
    """Return a recording with what a set-up's detectors said of it at ``time_s``."""
    return ScoredRecording(
        name=item.name,
        info=item.info,
        intervals=item.intervals,
        time_s=time_s,
        scores=scores,
        thresholds=limits["sigma"],
        operating_thresholds=limits["operating"],
        first_consequence_s=first_consequence(
            item, data.case, limits, config.evaluation.consequence_s
        ),
        horizon_steps=data.spec.horizon_steps,
        context_steps=data.spec.context_steps,
        step_s=1 / data.case.rate_hz,
    )


@dataclass(frozen=True)
class Judged:
    """One detector's thresholds and its scores of test recordings, (sample,) by name."""

    sigma: float
    operating: float
    scores: Mapping[str, Scores]


def judge_scores(
    config: ConfigView,
    data: MemberData,
    calibration: Sequence[Scores],
    test: Sequence[Scores],
) -> Judged:
    """Set a detector's thresholds on calibration recordings, as the pipeline does."""
    case, point = data.case, config.evaluation.operating_point
    sigma = sigma_threshold(np.concatenate(calibration), config.capability.threshold_sigmas)
    runs = [
        (scores[start:stop] / sigma, 1 / case.rate_hz)
        for item, scores in zip(data.splits["calibration"], calibration, strict=True)
        for start, stop in item.segments
    ]
    rate = point.promised_per_hour * point.set_to_share_of_promise
    operating = sigma * calibrate_operating_threshold(runs, rate, case.persistence_s)
    names = [item.name for item in data.splits["test"]]
    return Judged(sigma, operating, dict(zip(names, test, strict=True)))


def write_judged(folder: Path, judged: Mapping[str, Judged]) -> None:
    """Write detectors' scores and thresholds into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, one in judged.items():
        parts = [
            pd.DataFrame({"recording": recording, "score": scores.astype(np.float32)})
            for recording, scores in one.scores.items()
        ]
        pd.concat(parts, ignore_index=True).to_parquet(folder / f"{name}.parquet", index=False)
        limits = json.dumps({"sigma": one.sigma, "operating": one.operating}, indent=1)
        # Last and at once: whoever is killed before has nothing that looks finished.
        unfinished = folder / f"{name}.json.part"
        unfinished.write_text(limits + "\n", encoding="utf-8")
        unfinished.replace(folder / f"{name}.json")


def read_judged(folder: Path) -> dict[str, Judged]:
    """Return the detectors in a folder by name, in the order of their names."""
    found = {}
    for path in sorted(folder.glob("*.json")):
        limits = read_json(path)
        table = pd.read_parquet(path.with_suffix(".parquet"))
        scores = {
            str(name): part["score"].to_numpy(dtype=np.float64)
            for name, part in table.groupby("recording", sort=False)
        }
        found[path.stem] = Judged(limits["sigma"], limits["operating"], scores)
    return found


def with_detectors(
    scored: Sequence[ScoredRecording], data: MemberData, judged: Mapping[str, Judged]
) -> list[ScoredRecording]:
    """Return scored recordings with more detectors, read at the same times."""
    by_name = {item.name: item for item in data.splits["test"]}
    joined = []
    for one in scored:
        at = np.searchsorted(by_name[one.name].time_s, one.time_s)
        added = {name: found.scores[one.name][at] for name, found in judged.items()}
        joined.append(
            replace(
                one,
                scores={**one.scores, **added},
                thresholds={**one.thresholds, **{n: j.sigma for n, j in judged.items()}},
                operating_thresholds={
                    **one.operating_thresholds,
                    **{n: j.operating for n, j in judged.items()},
                },
            )
        )
    return joined
