"""Run a trained twin over a recording: every score that is known at time t, for many t."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.baselines.forecast_error import delayed, forecast_rmse
from odisar.capability.scores import (
    predictive_variance,
    reconstruction_error,
    state_reconstruction_errors,
)
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from odisar.twin.mc_dropout import draw_forecasts
from odisar.twin.transformer import TwinOutput

#: Names of the deployable detectors whose scores a recording gets.
ODISAR, RMSE, RMSE_SHORT = "odisar", "rmse", "rmse-short-lead"
DETECTORS = (ODISAR, RMSE, RMSE_SHORT)


@dataclass(frozen=True)
class RecordingScores:
    """Scores of a recording at its issue positions.

    ``positions`` (window,) are sample positions t; ``scores`` maps a detector to (window,) what it
    says at t, NaN while it cannot say anything yet; ``state_errors`` (window, state), scaled.
    """

    positions: NDArray[np.int64]
    scores: Mapping[str, NDArray[np.float32]]
    state_errors: NDArray[np.float32]


class Scorer:
    """A trained twin on a device, asked for forecasts in batches."""

    def __init__(self, twin: TrainedTwin, batch: int, device: str) -> None:
        self.twin = twin
        self._batch = batch
        self._device = torch.device(device)
        self._network = twin.network.to(self._device).eval()

    def score(self, recording: Recording, *, short_lead_steps: int) -> RecordingScores:
        """Score a recording at every position with a full context.

        The last h positions of a segment are scored as well, as a forecast needs no future
        (unless commands must be known ahead). The forecast-error baselines compare forecasts
        issued h (or the short lead) steps before t with what has been observed up to t.
        """
        horizon = self.twin.spec.horizon_steps
        parts: list[RecordingScores] = []
        samples = self._samples(recording)
        for start, stop in recording.segments:
            positions = self._scorable(start, stop)
            if positions.size == 0:
                continue
            state_errors, full, short = self._score_segment(
                samples[:stop], positions, short_lead_steps
            )
            scores = {
                ODISAR: reconstruction_error(state_errors),
                RMSE: delayed(full, horizon),
                RMSE_SHORT: delayed(short, short_lead_steps),
            }
            parts.append(RecordingScores(positions, scores, state_errors))
        return _joined(parts, len(self.twin.spec.outputs))

    def variances(self, recording: Recording, positions: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return (window,) Monte Carlo variance of the forecasts issued at ``positions``."""
        samples = self._samples(recording)
        variances = [
            predictive_variance(
                draw_forecasts(self._network, self.twin.masks, *self._inputs(samples, chunk))
                .forecast.cpu()
                .numpy()
            )
            for chunk in _chunks(positions, max(1, self._batch // 8))
        ]
        return np.concatenate([np.empty(0, dtype=np.float32), *variances])

    def forecast(self, recording: Recording, positions: NDArray[np.int64]) -> TwinOutput:
        """Return forecasts and reconstructions (window, step, state), scaled, on the CPU."""
        outputs = [
            self._forecast(self._samples(recording), chunk)
            for chunk in _chunks(positions, self._batch)
        ]
        return TwinOutput(
            torch.cat([output.forecast for output in outputs]),
            torch.cat([output.reconstruction for output in outputs]),
        )

    def _scorable(self, start: int, stop: int) -> NDArray[np.int64]:
        spec = self.twin.spec
        needed_after = spec.horizon_steps if spec.known_ahead else 0
        return np.arange(start + spec.context_steps - 1, stop - needed_after, dtype=np.int64)

    def _score_segment(
        self, samples: torch.Tensor, positions: NDArray[np.int64], short_lead: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        spec = self.twin.spec
        state_errors, full, short = [], [], []
        for chunk in _chunks(positions, self._batch):
            output = self._forecast(samples, chunk)
            forecast = output.forecast.numpy()
            state_errors.append(
                state_reconstruction_errors(forecast, output.reconstruction.numpy())
            )
            truth = _futures(samples, chunk, spec.horizon_steps)[..., list(spec.outputs)]
            full.append(forecast_rmse(forecast, truth, spec.horizon_steps))
            short.append(forecast_rmse(forecast, truth, short_lead))
        return np.concatenate(state_errors), np.concatenate(full), np.concatenate(short)

    @torch.inference_mode()
    def _forecast(self, samples: torch.Tensor, positions: NDArray[np.int64]) -> TwinOutput:
        output: TwinOutput = self._network(*self._inputs(samples, positions))
        return TwinOutput(output.forecast.cpu(), output.reconstruction.cpu())

    def _inputs(
        self, samples: torch.Tensor, positions: NDArray[np.int64]
    ) -> tuple[torch.Tensor, torch.Tensor]:
        spec = self.twin.spec
        back = torch.arange(1 - spec.context_steps, 1)
        context = samples[torch.from_numpy(positions)[:, None] + back]
        known = torch.empty(len(positions), spec.horizon_steps, 0)
        if spec.known_ahead:
            known = torch.from_numpy(_futures(samples, positions, spec.horizon_steps))
            known = known[..., list(spec.known_ahead)]
        return context.to(self._device), known.to(self._device)

    def _samples(self, recording: Recording) -> torch.Tensor:
        return torch.from_numpy(self.twin.scaler.scale(recording.values))


def _futures(
    samples: torch.Tensor, positions: NDArray[np.int64], horizon: int
) -> NDArray[np.float32]:
    """Return (window, step, channel) samples after t, NaN beyond the segment's end."""
    padded = np.vstack(
        [samples.numpy(), np.full((horizon, samples.shape[1]), np.nan, dtype=np.float32)]
    )
    steps: NDArray[np.float32] = padded[positions[:, None] + np.arange(1, horizon + 1)]
    return steps


def _chunks(positions: NDArray[np.int64], size: int) -> list[NDArray[np.int64]]:
    return [positions[i : i + size] for i in range(0, len(positions), size)]


def _joined(parts: list[RecordingScores], states: int) -> RecordingScores:
    if not parts:
        empty = np.empty(0, dtype=np.float32)
        return RecordingScores(
            np.empty(0, dtype=np.int64),
            dict.fromkeys(DETECTORS, empty),
            np.empty((0, states), dtype=np.float32),
        )
    return RecordingScores(
        np.concatenate([part.positions for part in parts]),
        {name: np.concatenate([part.scores[name] for part in parts]) for name in parts[0].scores},
        np.concatenate([part.state_errors for part in parts]),
    )
