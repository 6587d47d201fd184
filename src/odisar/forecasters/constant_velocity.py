"""Motion goes on as it is: what a forecast of moving things has to beat."""

from collections.abc import Sequence

import numpy as np
import torch

from odisar.errors import OdisarError
from odisar.forecasters.last_state import LastStates
from odisar.forecasters.moments import batches
from odisar.windows.coordinates import FloatArray
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec


class ConstantVelocity:
    """A relative pose keeps its rates; every other state keeps a damped part of its slope.

    The last rates of the pose are integrated as a constant twist (constant turn rate and
    velocity: a circular arc, in closed form). Any other state goes on from its last value with
    its mean slope over the last few steps, damped by a factor a step (Gardner and McKenzie 1985,
    Management Science, without their smoothing): a rate held over a whole horizon runs away. Each
    state takes the slope's steps and the damping with the least squared error on ``train``; a
    damping of 0 is persistence.
    """

    def __init__(
        self,
        scaler: Scaler,
        spec: WindowSpec,
        rate_hz: float,
        slope_steps: Sequence[int],
        dampings: Sequence[float],
    ) -> None:
        self._last = LastStates.of(scaler, spec)
        self._spec = spec
        self._rate_hz = rate_hz
        self._slope_steps = tuple(steps for steps in slope_steps if steps < spec.context_steps)
        self._dampings = tuple(dampings)
        self._chosen: list[tuple[int, float]] | None = None
        if not self._slope_steps:
            raise OdisarError(
                f"slope_steps={list(slope_steps)} do not fit into a context of "
                f"{spec.context_steps} steps; offer a smaller number"
            )

    @property
    def chosen(self) -> list[tuple[int, float]]:
        """Steps of the slope and damping of each state that is no part of the pose."""
        if self._chosen is None:
            raise OdisarError("constant velocity has no slopes and dampings yet; call fit first")
        return self._chosen

    def fit(self, train: WindowSet, validation: WindowSet) -> None:  # noqa: ARG002
        """Choose slope and damping of each state on ``train``."""
        states = list(self._last.plain)
        choices = [(k, d) for k in self._slope_steps for d in self._dampings]
        squares = np.zeros((len(choices), len(states)))
        if states:
            for batch in batches(train):
                observed = self._last.states(batch.context)
                moved = (batch.truth[..., states] - observed[:, -1:]).double().numpy()
                for i, (steps, damping) in enumerate(choices):
                    going_on = self._gains(damping) * _slope(observed, steps)[:, None]
                    squares[i] += np.sum((moved - going_on) ** 2, axis=(0, 1))
        self._chosen = [choices[i] for i in squares.argmin(axis=0)]

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:  # noqa: ARG002
        """Return (window, horizon step, state), scaled; the known future plays no part."""
        observed = self._last.states(context)
        parts = [
            self._gains(damping) * _slope(observed[..., i : i + 1], steps)[:, None]
            for i, (steps, damping) in enumerate(self.chosen)
        ]
        nothing = np.zeros((len(context), self._spec.horizon_steps, 0))
        moved = torch.from_numpy(np.concatenate([nothing, *parts], axis=-1)).float()
        return self._last.assembled(observed[:, -1:] + moved, self._displacement(context))

    def _gains(self, damping: float) -> FloatArray:
        """Return (step, 1) how many slopes a state has gone by then."""
        return np.cumsum(damping ** np.arange(1, self._spec.horizon_steps + 1))[:, None]

    def _displacement(self, context: torch.Tensor) -> FloatArray:
        if self._spec.pose is None:
            return np.zeros((len(context), self._spec.horizon_steps, 3))
        ahead_s = np.arange(1, self._spec.horizon_steps + 1) / self._rate_hz
        return arc(self._last.pose_rates(context), ahead_s, 1.0 / self._rate_hz)


def arc(rates: FloatArray, ahead_s: FloatArray, step_s: float) -> FloatArray:
    """Return (window, step, 3) displacement [m, m, rad] of a body that keeps its twist.

    ``rates`` (window, 3) are those of ``windows.coordinates.pose_rates``, increments over
    ``step_s`` along the mean heading: chords, a little shorter than the arcs that they span.
    """
    turn = rates[:, None, 2]
    turned = turn * ahead_s
    speed = rates[:, None, :2] / np.sinc(turn * step_s / (2 * np.pi))[..., None]
    along = ahead_s * np.sinc(turned / np.pi)
    aside = ahead_s * np.sinc(turned / (2 * np.pi)) * np.sin(turned / 2)
    return np.stack(
        [
            along * speed[..., 0] - aside * speed[..., 1],
            aside * speed[..., 0] + along * speed[..., 1],
            turned,
        ],
        axis=-1,
    )


def _slope(observed: torch.Tensor, steps: int) -> FloatArray:
    """Return (window, state) mean change a step over the last steps."""
    change = observed[:, -1] - observed[:, -1 - steps]
    return np.asarray(change.double().numpy() / steps, dtype=np.float64)
