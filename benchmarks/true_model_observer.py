"""What an observer with the true model reaches on the ferry, beside what a twin has to learn.

An extended Kalman filter knows the ferry's hull, its loading, its thrusters and its sensors' noise,
as the simulator has them; what it does not know is the light weather that is normal, and the
disturbance. Its process noise is fitted on undisturbed validation recordings by the likelihood of
their innovations (Bar-Shalom, Li and Kirubarajan, 2001, chapter 5); its innovations are then judged
as the twin's are, on the test recordings, by protocol P2; F1 is at mu + k sigma of its scores of
calibration recordings. Run it from the project's root after `make repro`:

    .venv/bin/python benchmarks/true_model_observer.py
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.metrics import f1_score

from odisar.artifacts import Workspace
from odisar.capability.combined import SATURATED
from odisar.capability.innovations import InnovationScore, InnovationSize, LogScale
from odisar.capability.release import Release
from odisar.capability.thresholds import sigma_threshold
from odisar.config.loader import load_config
from odisar.config.score import ScoreConfig
from odisar.config.simulators import VesselSimulatorConfig
from odisar.evaluation.labels import label_active
from odisar.evaluation.metrics import auroc, tnr_at_tpr95
from odisar.recordings.schema import Recording
from odisar.simulators.vessel.dynamics import STATE_ROWS, Current, Orders, advance, no_force
from odisar.simulators.vessel.hull import ferry
from odisar.stages.detectors import score_steps
from odisar.stages.members import Member, load_member

Array = NDArray[np.float64]

SETUP = "vessel-all"
#: Rows of the simulator's state that the filter estimates: roll, u, v, p, r. The rudder follows
#: its order as the simulator's does; position and heading move nothing in calm water.
ROLL, ESTIMATED, AZIMUTH, RPM = 2, (2, 4, 5, 6, 7), 8, 9
#: Recorded channels, in the order of the estimated rows, and what turns a row into one.
CHANNELS = {"Roll Angle": -180 / np.pi, "Surge Speed": 1.0, "Sway Speed": 1.0,
            "Roll Rate": -180 / np.pi, "Yaw Rate": 180 / np.pi}  # fmt: skip
#: Multipliers of the process noise that are tried, for speeds and for rates.
SCALES = (0.03, 0.1, 0.3, 1.0, 3.0)
#: A step for derivatives, in the recorded units: small against every sensor's noise.
NUDGE = 1e-4


@dataclass(frozen=True)
class Fleet:
    """Recordings side by side: ``order_deg`` (time, run), ``seen`` (time, run, channel)."""

    order_deg: Array
    seen: Array
    loading: Array

    @classmethod
    def of(cls, recordings: Sequence[Recording], names: Sequence[str]) -> "Fleet":
        """Return recordings of one length side by side."""
        values = np.stack([recording.values for recording in recordings], axis=1)
        seen = values[:, :, [names.index(channel) for channel in CHANNELS]]
        loading = np.array([float(recording.info.column("loading")) for recording in recordings])
        return cls(values[:, :, names.index("Rudder Angle")], seen, loading)


class Observer:
    """An extended Kalman filter on the simulator's own hull, in the recorded channels' units."""

    def __init__(self, config: VesselSimulatorConfig) -> None:
        self._config = config
        self._units = np.array(list(CHANNELS.values()))
        sensors = [config.sensors[name] for name in CHANNELS]
        # Rounding to the resolution adds the variance of a uniform error.
        self.sensor_noise = np.diag([s.noise**2 + s.resolution**2 / 12 for s in sensors])

    def innovations(self, fleet: Fleet, process_noise: Array) -> tuple[Array, float]:
        """Return (time, run, channel) innovations, NaN at first, and their mean log likelihood."""
        count = fleet.seen.shape[1]
        found = np.full(fleet.seen.shape, np.nan)
        estimate = fleet.seen[0].copy()
        covariance = np.broadcast_to(self.sensor_noise, (count, 5, 5)).copy()
        azimuth, likelihoods = np.deg2rad(fleet.order_deg[0]), []
        for at in range(1, len(fleet.seen)):
            estimate, slopes, azimuth = self._predict(fleet, estimate, azimuth, at - 1)
            covariance = slopes @ covariance @ slopes.transpose(0, 2, 1) + process_noise
            spread = covariance + self.sensor_noise
            innovation = fleet.seen[at] - estimate
            weighed = np.linalg.solve(spread, innovation[..., None])[..., 0]
            found[at] = innovation
            distance = np.einsum("rc,rc->r", innovation, weighed)
            likelihoods.append(-0.5 * (distance + np.linalg.slogdet(spread)[1]))
            estimate = estimate + np.einsum("rij,rj->ri", covariance, weighed)
            covariance = covariance - covariance @ np.linalg.solve(spread, covariance)
        return found, float(np.mean(likelihoods))

    def _predict(
        self, fleet: Fleet, estimate: Array, azimuth: Array, at: int
    ) -> tuple[Array, Array, Array]:
        """Return forecasts (run, channel), their slopes (run, channel, channel), the azimuth."""
        count = len(estimate)
        nudged = np.concatenate([estimate, *(estimate + NUDGE * row for row in np.eye(5))])
        copies = len(nudged) // count
        state = np.zeros((len(STATE_ROWS), len(nudged)))
        state[list(ESTIMATED)] = (nudged / self._units).T
        state[AZIMUTH], state[RPM] = np.tile(azimuth, copies), self._config.ferry.rpm
        hull = ferry(self._config.ferry, np.tile(fleet.loading, copies))
        order = np.tile(np.deg2rad(fleet.order_deg[at]), copies)
        still, calm = np.zeros(len(nudged)), no_force(len(nudged))
        orders = Orders(order, np.full(len(nudged), self._config.ferry.rpm))
        for _ in range(round(1.0 / self._config.step_s)):
            state = advance(
                hull, state, orders, Current(still, still), (calm,) * 3, self._config.step_s
            )
        after = (state[list(ESTIMATED)].T * self._units).reshape(copies, count, 5)
        slopes = ((after[1:] - after[0]) / NUDGE).transpose(1, 2, 0)
        return after[0], slopes, state[AZIMUTH, :count]


def fit_process_noise(observer: Observer, fleet: Fleet) -> Array:
    """Return (channel, channel) the process noise under which held-out innovations are likeliest.

    What one step of the model misses from measured states, less what sensors add to it, is where
    the search begins; speeds and rates are scaled apart.
    """
    loose = observer.sensor_noise * 1e6
    first, _ = observer.innovations(fleet, loose)
    missed = np.nanvar(first, axis=(0, 1)) - 2 * np.diag(observer.sensor_noise)
    base = np.maximum(missed, 0.1 * np.diag(observer.sensor_noise))
    is_speed = np.array([name.endswith("Speed") for name in CHANNELS])

    def scaled(speeds: float, rates: float) -> Array:
        return np.diag(base * np.where(is_speed, speeds, rates))

    trials = {
        pair: observer.innovations(fleet, scaled(*pair))[1] for pair in product(SCALES, SCALES)
    }
    return scaled(*max(trials, key=lambda pair: trials[pair]))


@dataclass(frozen=True)
class Mean:
    """The mean of statistics and of scatter, as of the closed form alone."""

    score: InnovationScore
    scatter: InnovationSize
    share: float

    def of(self, innovations: Array) -> Array:
        """Return (time,) the mean along one run."""
        logs = np.log(self.score.score(innovations, np.zeros(len(innovations))))
        scatter = np.minimum(self.scatter.scale.of(self.scatter.statistic(innovations)), SATURATED)
        return np.asarray(np.exp((1 - self.share) * logs + self.share * scatter))


@dataclass(frozen=True)
class Judge:
    """The statistics that the monitor has of innovations, scatter that adds up among them."""

    mean: Mean
    scale: LogScale
    release: Release

    @classmethod
    def fit(cls, runs: Sequence[Array], config: ScoreConfig) -> "Judge":
        """Fit on innovations (time, state) of undisturbed recordings."""
        steps = score_steps(config)
        score = InnovationScore.fit(runs, None, steps.innovation)
        mean = Mean(score, InnovationSize.fit(runs, steps.scatter), steps.scatter_share)
        scale = LogScale.fit(np.concatenate([mean.of(run) for run in runs]))
        return cls(mean, scale, steps.release)

    def score(self, innovations: Array) -> Array:
        """Return (time,) scores of one run: its mean, let go of what is over."""
        return np.exp(self.release.of(self.scale.of(self.mean.of(innovations))))


def main() -> None:
    """Fit, score, and print by component and strength."""
    config, workspace = load_config(Path.cwd()), Workspace(Path.cwd())
    data = load_member(config, workspace, Member(SETUP, None))
    observer, names = Observer(config.simulators.vessel), data.case.channel_names
    held_out = Fleet.of(data.splits["validation"], names)
    noise = fit_process_noise(observer, held_out)
    usual, _ = observer.innovations(held_out, noise)
    judge = Judge.fit(list(usual.transpose(1, 0, 2)[:, 1:]), config.cases["vessel"].score)
    # As in the pipeline's tables: from the first time at which every detector can speak.
    known = slice(data.spec.context_steps + data.spec.horizon_steps, None)

    def judged(recordings: Sequence[Recording]) -> list[Array]:
        found, _ = observer.innovations(Fleet.of(recordings, names), noise)
        return [judge.score(found[:, run])[known] for run in range(len(recordings))]

    calibration = np.concatenate(judged(data.splits["calibration"]))
    threshold = sigma_threshold(calibration, config.capability.threshold_sigmas)
    disturbed = [item for item in data.splits["test"] if item.info.is_disturbed]
    cells: dict[tuple[str, float], list[tuple[Array, NDArray[np.bool_]]]] = {}
    for item, scores in zip(disturbed, judged(disturbed), strict=True):
        labels = label_active(item.time_s[known], item.intervals)
        cells.setdefault((item.info.components, item.info.strength), []).append((scores, labels))
    rows = []
    for (components, strength), members in sorted(cells.items()):
        scores, labels = (np.concatenate(part) for part in zip(*members, strict=True))
        ranking = auroc(scores, labels), tnr_at_tpr95(scores, labels)
        rows.append((components, strength, *ranking, f1_score(labels, scores > threshold)))
    table = pd.DataFrame(rows, columns=["components", "strength", "AUROC", "TNR@TPR95", "F1"])
    print(table.round(4).to_string(index=False))


if __name__ == "__main__":
    main()
