"""What the last samples of a window say about the states that are forecast, in scaled targets."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.windows.coordinates import POSE_RATES, FloatArray, feature_positions
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec


@dataclass(frozen=True)
class LastStates:
    """Reads the forecast states, and the rates of a relative pose, out of a context.

    ``plain`` are the positions, among the states, of those that stand among the features
    themselves, and ``places`` where they stand there; the other states are parts of the pose.
    """

    scaler: Scaler
    spec: WindowSpec
    plain: tuple[int, ...]
    places: tuple[int, ...]

    @classmethod
    def of(cls, scaler: Scaler, spec: WindowSpec) -> "LastStates":
        """Return the reader for windows of a spec, scaled by ``scaler``."""
        pose = spec.pose
        in_pose = () if pose is None else pose.positions
        plain = tuple(i for i, channel in enumerate(spec.outputs) if channel not in in_pose)
        channels = len(scaler.mean)
        if pose is not None:
            channels += len(in_pose) - POSE_RATES
        wanted = [spec.outputs[i] for i in plain]
        return cls(scaler, spec, plain, feature_positions(wanted, channels, pose))

    def states(self, context: torch.Tensor) -> torch.Tensor:
        """Return (window, context step, plain state) in the scale of the targets."""
        slope, offset = self.rescaling()
        return _tensor(context[..., list(self.places)].double().numpy() * slope + offset)

    def rescaling(self) -> tuple[FloatArray, FloatArray]:
        """Return (plain state,) slope and offset from the scale of features to that of targets."""
        features, states = list(self.places), list(self.plain)
        target_std = self.scaler.target_std[states]
        offset = (self.scaler.mean[features] - self.scaler.target_mean[states]) / target_std
        return self.scaler.std[features] / target_std, offset

    def pose_rates(self, context: torch.Tensor) -> FloatArray:
        """Return (window, 3) the last rates along, across [m/s] and about [rad/s] the body."""
        last = context[:, -1, :POSE_RATES].double().numpy()
        return np.asarray(
            last * self.scaler.std[:POSE_RATES] + self.scaler.mean[:POSE_RATES], dtype=np.float64
        )

    def assembled(self, states: torch.Tensor, moved: FloatArray) -> torch.Tensor:
        """Return (window, step, state) scaled targets.

        From plain ``states`` (window, step, plain state), scaled, and displacements ``moved``
        (window, step, 3) of the pose, physical; without a pose ``moved`` plays no part.
        """
        joined = torch.empty(*states.shape[:2], len(self.spec.outputs))
        joined[..., list(self.plain)] = states
        if self.spec.pose is not None:
            channels = self.spec.pose.write(moved)
            for state, channel in enumerate(self.spec.outputs):
                if state not in self.plain:
                    value = channels[..., self.spec.pose.positions.index(channel)]
                    mean, std = self.scaler.target_mean[state], self.scaler.target_std[state]
                    joined[..., state] = _tensor((value - mean) / std)
        return joined


def _tensor(values: NDArray[np.floating[Any]]) -> torch.Tensor:
    return torch.from_numpy(np.asarray(values, dtype=np.float32))
