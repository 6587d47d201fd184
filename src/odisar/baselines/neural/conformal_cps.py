"""Conformal detection by temporal equivariance: whether it shows what was done to a window.

After Kaur et al., CODiT: Conformal Out-of-Distribution Detection in Time-Series Data for
Cyber-Physical Systems, ICCPS 2023. A classifier learns, on undisturbed windows, which
transformation each has undergone; where windows are unlike those, it errs. Its loss is turned into
a conformal p-value against held-out windows, and several p-values into one by Fisher's method.
"""

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

from odisar.baselines.interface import Reference
from odisar.baselines.neural.learning import fitted_network, reference_windows
from odisar.baselines.neural.scoring import ContextWindows, FloatArray, WindowDetector
from odisar.baselines.neural.transformations import TRANSFORMATIONS, transformed
from odisar.fitting import FitBudget
from odisar.seeding import derive_seed

_CHANNELS = 32
# Places along the window at which the classifier keeps what it found.
_POOLED = 4


class TransformationClassifier(nn.Sequential):
    """A small convolutional network: (window, step, feature) to (window, transformation) logits."""

    def __init__(self, features: int) -> None:
        super().__init__(
            _StepsLast(),
            nn.Conv1d(features, _CHANNELS, 5, stride=2, padding=2),
            nn.ReLU(),
            nn.Conv1d(_CHANNELS, _CHANNELS, 5, stride=2, padding=2),
            nn.ReLU(),
            nn.AdaptiveAvgPool1d(_POOLED),
            nn.Flatten(),
            nn.Linear(_CHANNELS * _POOLED, 64),
            nn.ReLU(),
            nn.Linear(64, len(TRANSFORMATIONS)),
        )

    def losses(self, windows: torch.Tensor) -> torch.Tensor:
        """Return (window, transformation) cross-entropy of each transformed window.

        ``windows`` is (window, step, feature), scaled. High where the classifier doesn't see what
        was done: the nonconformity of a window under that transformation.
        """
        asked = transformed(windows)
        truth = torch.arange(len(asked)).repeat_interleave(len(windows))
        losses = F.cross_entropy(self(asked.flatten(0, 1)), truth, reduction="none")
        return losses.view(len(asked), len(windows)).T


class ConformalTransformations(WindowDetector):
    """Fisher's statistic of the p-values of the last windows under every transformation.

    Departures from the published method: every transformation is applied to every window (there
    they are sampled); windows end at t, and those that count lie ``stride_steps`` apart and
    overlap, so their p-values are not independent. The statistic is therefore a score to be
    calibrated like any other, not a test with a level of its own.
    """

    def __init__(
        self, budget: FitBudget, *, stride_steps: int = 5, windows_counted: int = 4
    ) -> None:
        super().__init__(stride_steps)
        self._budget, self._windows_counted = budget, windows_counted

    def _learn(self, reference: Reference, _windows: ContextWindows) -> None:
        """Fit the classifier on training windows; held-out ones, end to end, are the measure."""
        windows = reference_windows(reference)
        self._network = fitted_network(
            "transformation classifier",
            lambda: TransformationClassifier(windows[0].samples.shape[1]),
            lambda network, batch: network.losses(batch.context).mean(),
            windows,
            self._budget,
            derive_seed(reference.seed, "codit"),
        )
        end_to_end = ContextWindows.of(reference, reference.spec.context_steps)
        known = [
            losses
            for recording in reference.held_out
            for losses in end_to_end.values(recording, self._network.losses)
        ]
        self._known_losses = np.sort(np.concatenate(known), axis=0)

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        """Return (window, transformation) losses."""
        return self._network.losses(contexts)

    def _of_segment(self, values: FloatArray) -> FloatArray:
        """Return (window,) statistics from (window, transformation) losses, in order of time.

        The first windows of a segment have fewer before them; their mean stands for the sum.
        """
        log_p = np.log(conformal_p_values(values, self._known_losses)).sum(axis=1)
        sums = np.cumsum(np.concatenate([[0.0], log_p]))
        last = np.arange(1, len(sums))
        first = np.maximum(0, last - self._windows_counted)
        counted = (sums[last] - sums[first]) / (last - first)
        return np.asarray(-2.0 * self._windows_counted * counted)


def conformal_p_values(losses: FloatArray, known_losses: FloatArray) -> FloatArray:
    """Return (window, transformation) shares of known losses that are at least as high.

    ``known_losses`` is (known window, transformation), ascending. The window itself counts among
    them, so no share is zero (Vovk, Gammerman and Shafer, 2005, chapter 2).
    """
    known = len(known_losses)
    below = np.column_stack(
        [
            np.searchsorted(known_losses[:, i], losses[:, i], side="left")
            for i in range(losses.shape[1])
        ]
    )
    return np.asarray((known - below + 1.0) / (known + 1.0), dtype=np.float64)


class _StepsLast(nn.Module):
    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        return windows.transpose(1, 2)
