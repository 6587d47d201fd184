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
from odisar.windows.targets import horizon_targets
from odisar.windows.window_set import model_inputs, scaled_features

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
        needed_after = horizon if self.twin.spec.known_ahead else 0
        for segment in recording.segments:
            positions = self.twin.spec.issue_positions(segment, 1, horizon_steps=needed_after)
            if positions.size == 0:
                continue
            observed = recording.values[: segment[1]]
            state_errors, full, short = self._score_segment(
                samples, observed, positions, short_lead_steps
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
        samples = self._samples(recording)
        outputs = [self._forecast(samples, chunk) for chunk in _chunks(positions, self._batch)]
        return TwinOutput(
            torch.cat([output.forecast for output in outputs]),
            torch.cat([output.reconstruction for output in outputs]),
        )

    def _score_segment(
        self,
        samples: torch.Tensor,
        observed: NDArray[np.float64],
        positions: NDArray[np.int64],
        short_lead: int,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        spec = self.twin.spec
        state_errors, full, short = [], [], []
        for chunk in _chunks(positions, self._batch):
            output = self._forecast(samples, chunk)
            forecast = output.forecast.numpy()
            state_errors.append(
                state_reconstruction_errors(forecast, output.reconstruction.numpy())
            )
            truth = self.twin.scaler.scale_targets(horizon_targets(observed, chunk, spec))
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
        channels = len(self.twin.channel_names)
        context, known = model_inputs(samples, positions, self.twin.spec, channels)
        return context.to(self._device), known.to(self._device)

    def _samples(self, recording: Recording) -> torch.Tensor:
        return scaled_features([recording], self.twin.scaler, self.twin.spec)


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
