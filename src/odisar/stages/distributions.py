"""The predictive distributions of a member: fitted in calibration, judged on test recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from odisar.capability.distribution import NoiseFloor, draws_only, fit_noise, with_noise
from odisar.capability.recalibration import (
    FEWEST_WINDOWS,
    LevelMap,
    Recalibration,
    fit_recalibration,
    predictive_distributions,
)
from odisar.capability.scoring import Scorer
from odisar.evaluation.reliability import RecordingForecasts
from odisar.recordings.schema import Recording
from odisar.stages.members import MemberData
from odisar.windows.targets import horizon_targets

#: Draws (draw, window, step, state) and truth (window, step, state), scaled, of one recording.
Drawn = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True)
class Distributions:
    """What turns dropout draws into calibrated distributions."""

    noise: NoiseFloor
    recalibration: Recalibration

    @classmethod
    def fit(cls, held_out: Sequence[Drawn], calibration: Sequence[Drawn]) -> Self:
        """Fit the noise on validation recordings, the recalibration on calibration recordings.

        With fewer than ``FEWEST_WINDOWS`` calibration windows nothing is recalibrated.
        """
        noise = fit_noise([draws_only(draws) for draws, _ in held_out], [t for _, t in held_out])
        levels = [with_noise(draws_only(draws), noise).levels(t) for draws, t in calibration]
        windows = sum(len(part) for part in levels)
        if windows < FEWEST_WINDOWS:  # a few windows say nothing: levels stay as they are
            return cls(noise, _unchanged(noise, windows))
        return cls(noise, fit_recalibration(levels))

    def as_json(self) -> dict[str, Any]:
        """Return plain numbers; ``from_json`` takes them back."""
        return {"noise": self.noise.as_json(), "recalibration": self.recalibration.as_json()}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Self:
        """Return what ``as_json`` gave."""
        return cls(
            NoiseFloor.from_json(content["noise"]),
            Recalibration.from_json(content["recalibration"]),
        )

    def forecasts(self, recording: Recording, drawn: Drawn) -> RecordingForecasts:
        """Return a recording's distributions beside what came true."""
        draws, truth = drawn
        return RecordingForecasts(
            name=recording.name,
            cluster=recording.info.base_seed or recording.name,
            truth=truth.astype(np.float64),
            distributions=predictive_distributions(draws, self.noise, self.recalibration),
            draws=draws,
        )


def draw_with_truth(
    scorer: Scorer, data: MemberData, recording: Recording, positions: NDArray[np.int64]
) -> Drawn:
    """Return draws and truth of the windows at ``positions`` whose whole horizon was recorded."""
    truth = np.concatenate(
        [np.empty((0, data.spec.horizon_steps, len(data.spec.outputs)))]
        + [
            horizon_targets(recording.values[:stop], _within(positions, start, stop), data.spec)
            for start, stop in recording.segments
        ]
    )
    whole = np.isfinite(truth).all(axis=(1, 2))
    return (
        scorer.draws(recording, positions[whole]),
        data.scaler.scale_targets(truth[whole]),
    )


def _within(positions: NDArray[np.int64], start: int, stop: int) -> NDArray[np.int64]:
    return positions[(positions >= start) & (positions < stop)]


def _unchanged(noise: NoiseFloor, windows: int) -> Recalibration:
    """Return a recalibration that leaves every level as it is."""
    horizon, states = noise.variance.shape
    same = LevelMap(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    return Recalibration(((same,) * states,), horizon, windows)
