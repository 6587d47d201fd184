"""Run a trained twin over a recording: every score that is known at time t, for many t."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.baselines.forecast_error import delayed, forecast_rmse
from odisar.capability.combined import (
    CLOSED_FORM,
    CONSISTENCY,
    ODISAR,
    WITHOUT_TRANSFORMER,
    InnovationScores,
    Run,
)
from odisar.capability.innovations import FloatArray
from odisar.capability.outliers import OutlierFilter
from odisar.capability.scores import (
    predictive_variance,
    reconstruction_error,
    state_reconstruction_errors,
)
from odisar.capability.shifts import ShiftFilter
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from odisar.twin.mc_dropout import draw_forecasts
from odisar.twin.transformer import TwinOutput
from odisar.windows.targets import horizon_targets
from odisar.windows.window_set import model_inputs, scaled_features

#: The paper's score, and the forecast-error baselines.
RECONSTRUCTION, RMSE, RMSE_SHORT = "reconstruction", "rmse", "rmse-short-lead"
DETECTORS = (
    ODISAR,
    WITHOUT_TRANSFORMER,
    CLOSED_FORM,
    CONSISTENCY,
    RECONSTRUCTION,
    RMSE,
    RMSE_SHORT,
)


@dataclass(frozen=True)
class RecordingScores:
    """Scores of a recording at its issue positions.

    ``positions`` (window,) are sample positions t; ``scores`` maps a detector to (window,) what it
    says at t, NaN while it cannot say anything yet; ``state_errors`` (window, state) are those of
    the reconstruction, ``innovations`` and ``closed_form_innovations`` (window, state feature) are
    NaN where there was no forecast of t yet, ``samples`` (window, feature) what was seen at t; all
    scaled. ``runs`` are half-open ranges of windows without a gap.
    """

    positions: NDArray[np.int64]
    scores: Mapping[str, NDArray[np.float32]]
    state_errors: NDArray[np.float32]
    innovations: NDArray[np.float64]
    closed_form_innovations: NDArray[np.float64]
    samples: NDArray[np.float32]
    runs: tuple[tuple[int, int], ...]


class Scorer:
    """A trained twin on a device, asked for forecasts in batches.

    Without fitted ``innovation_scores`` the scores that need them are left out.
    """

    def __init__(
        self,
        twin: TrainedTwin,
        batch: int,
        device: str,
        innovation_scores: InnovationScores | None = None,
    ) -> None:
        self.twin = twin
        self.innovation_scores = innovation_scores
        self._outliers = OutlierFilter.of(twin)
        self._shifts = ShiftFilter(self._outliers.response)
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
            if positions.size:
                observed = recording.values[: segment[1]]
                found = self._score_segment(samples, observed, positions, short_lead_steps)
                parts.append(self._with_innovation_scores(recording, found))
        states, features = len(self._network.state_features), len(self.twin.scaler.mean)
        return _joined(parts, len(self.twin.spec.outputs), states, features)

    def runs(self, recording: Recording, scores: RecordingScores) -> list[Run]:
        """Return what the monitor's score is made of, run by run, of a scored recording."""
        return [self._run(recording, scores, slice(*ends)) for ends in scores.runs]

    def _run(self, recording: Recording, scores: RecordingScores, at: slice) -> Run:
        positions, samples = scores.positions[at], scores.samples[at]
        closed_form = scores.closed_form_innovations[at]
        return Run(
            scores.innovations[at],
            closed_form,
            samples,
            scores.scores[RECONSTRUCTION][at].astype(np.float64),
            partial(self._outliers.squares, recording, positions, closed_form, samples),
            partial(self._shifts.ratios, samples),
        )

    def _with_innovation_scores(
        self, recording: Recording, found: RecordingScores
    ) -> RecordingScores:
        if self.innovation_scores is None:
            return found
        (run,) = self.runs(recording, found)
        return replace(found, scores=self.innovation_scores.of(run) | dict(found.scores))

    def draws(self, recording: Recording, positions: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return (draw, window, step, state) the dropout draws of forecasts, scaled."""
        samples = self._samples(recording)
        spec = self.twin.spec
        draws = len(next(iter(self.twin.masks.values())))
        parts = [np.empty((draws, 0, spec.horizon_steps, len(spec.outputs)), dtype=np.float32)]
        parts += [
            draw_forecasts(self._network, self.twin.masks, *self._inputs(samples, chunk))
            .forecast.cpu()
            .numpy()
            for chunk in _chunks(positions, max(1, self._batch // 8))
        ]
        return np.concatenate(parts, axis=1)

    def variances(self, recording: Recording, positions: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return (window,) Monte Carlo variance of the forecasts issued at ``positions``."""
        return predictive_variance(self.draws(recording, positions))

    def forecast_windows(self, context: torch.Tensor, known: torch.Tensor) -> torch.Tensor:
        """Return (window, step, state) forecasts of scaled windows (see ``model_inputs``)."""
        output = self._forecast(context.to(self._device), known.to(self._device))
        return output.forecast

    def forecast(self, recording: Recording, positions: NDArray[np.int64]) -> TwinOutput:
        """Return forecasts and reconstructions (window, step, state), scaled, on the CPU."""
        samples = self._samples(recording)
        outputs = [
            self._forecast(*self._inputs(samples, chunk))
            for chunk in _chunks(positions, self._batch)
        ]
        return TwinOutput(
            torch.cat([output.forecast for output in outputs]),
            torch.cat([output.reconstruction for output in outputs]),
            torch.cat([output.next_sample for output in outputs]),
        )

    def _score_segment(
        self,
        samples: torch.Tensor,
        observed: NDArray[np.float64],
        positions: NDArray[np.int64],
        short_lead: int,
    ) -> RecordingScores:
        spec = self.twin.spec
        state_errors, full, short, following, closed = [], [], [], [], []
        for chunk in _chunks(positions, self._batch):
            context, known = self._inputs(samples, chunk)
            output = self._forecast(context, known)
            forecast = output.forecast.numpy()
            state_errors.append(
                state_reconstruction_errors(forecast, output.reconstruction.numpy())
            )
            truth = self.twin.scaler.scale_targets(horizon_targets(observed, chunk, spec))
            full.append(forecast_rmse(forecast, truth, spec.horizon_steps))
            short.append(forecast_rmse(forecast, truth, short_lead))
            following.append(output.next_sample.numpy())
            closed.append(self._closed_form(context))
        seen = samples[positions].numpy()
        scaled = seen[:, list(self._network.state_features)]
        errors = np.concatenate(state_errors)
        rebuilt = reconstruction_error(errors)
        scores = {
            RECONSTRUCTION: rebuilt,
            RMSE: delayed(np.concatenate(full), spec.horizon_steps),
            RMSE_SHORT: delayed(np.concatenate(short), short_lead),
        }
        innovations = _innovations(scaled, np.concatenate(following))
        closed_form = _innovations(scaled, np.concatenate(closed))
        run = ((0, len(positions)),)
        return RecordingScores(positions, scores, errors, innovations, closed_form, seen, run)

    @torch.inference_mode()
    def _closed_form(self, context: torch.Tensor) -> NDArray[np.float32]:
        forecast: torch.Tensor = self._network.next_closed_form(context)
        return forecast.cpu().numpy()

    @torch.inference_mode()
    def _forecast(self, context: torch.Tensor, known: torch.Tensor) -> TwinOutput:
        output: TwinOutput = self._network(context, known)
        return TwinOutput(
            output.forecast.cpu(), output.reconstruction.cpu(), output.next_sample.cpu()
        )

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


def _innovations(scaled: NDArray[np.float32], following: NDArray[np.float32]) -> FloatArray:
    """Return (window, state feature) observed minus what was forecast one step before."""
    innovations = np.full(scaled.shape, np.nan)
    innovations[1:] = scaled[1:].astype(np.float64) - following[:-1]
    return innovations


def _joined(
    parts: list[RecordingScores], outputs: int, states: int, features: int
) -> RecordingScores:
    if not parts:
        empty, none = np.empty(0, dtype=np.float32), np.empty((0, states))
        return RecordingScores(
            np.empty(0, dtype=np.int64),
            dict.fromkeys(DETECTORS, empty),
            np.empty((0, outputs), dtype=np.float32),
            none,
            none,
            np.empty((0, features), dtype=np.float32),
            (),
        )
    lengths = [len(part.positions) for part in parts]
    borders = np.cumsum([0, *lengths]).tolist()
    return RecordingScores(
        np.concatenate([part.positions for part in parts]),
        {name: np.concatenate([part.scores[name] for part in parts]) for name in parts[0].scores},
        np.concatenate([part.state_errors for part in parts]),
        np.concatenate([part.innovations for part in parts]),
        np.concatenate([part.closed_form_innovations for part in parts]),
        np.concatenate([part.samples for part in parts]),
        tuple(pairwise(borders)),
    )
