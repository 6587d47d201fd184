"""What innovations say of a change in one state: the response of a twin's closed form.

In its first sample a change shows in its own state alone. Afterwards forecasts are made from
changed samples, and what shows is the change less what the closed form, linearised where the
machine is, carries on of it. (Of the Transformer no such thing is known; it stands on the closed
form and corrects it by little.)
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from odisar.capability.innovations import FloatArray
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin


def blamed_names(twin: TrainedTwin) -> tuple[str, ...]:
    """Return the names of the states that can be blamed, z and w of a heading being one."""
    spec, names = twin.spec, twin.channel_names
    states = [i for i in range(len(names)) if i not in spec.commands]
    if spec.pose is None:
        return tuple(names[i] for i in states)
    heading = " / ".join(names[i] for i in spec.pose.heading)
    others = [i for i in states if i not in spec.pose.positions]
    return (names[spec.pose.x], names[spec.pose.y], heading, *(names[i] for i in others))


def state_directions(
    twin: TrainedTwin, recording: Recording, positions: NDArray[np.int64]
) -> FloatArray:
    """Return (window, state, state feature) how a change of each state enters the scaled features.

    Without a relative pose a state is its feature. The rates of a pose are along the body's axes,
    its x and y on the map: a change of either turns with the heading at the window's position.
    """
    count = len(twin.scaler.mean)
    features = list(twin.spec.state_features(len(twin.channel_names)))
    directions = np.broadcast_to(np.eye(count), (len(positions), count, count)).copy()
    pose = twin.spec.pose
    if pose is not None:
        heading = pose.read(recording.values[positions])[:, 2]
        cos, sin = np.cos(heading), np.sin(heading)
        directions[:, 0, 0], directions[:, 0, 1] = cos, -sin
        directions[:, 1, 0], directions[:, 1, 1] = sin, cos
    return (directions / twin.scaler.std)[:, features][:, :, features]


@dataclass(frozen=True)
class StepResponse:
    """What innovations a unit shift of a state feature leaves, by its age in steps.

    ``linear`` (age, state feature, state feature) is that of the linear part of the closed form:
    column j of the first is what shows, in every feature, of a shift of feature j when it sets in;
    of the last what stays. ``products`` (state feature, feature, feature), symmetric, and
    ``squares`` (state feature, feature) are the weights of its other regressors; ``states`` are
    the positions of state features among the features.
    """

    linear: FloatArray
    products: FloatArray
    squares: FloatArray
    states: tuple[int, ...]

    @classmethod
    def of(cls, twin: TrainedTwin) -> Self:
        """Return the response of a twin's closed form of the next sample."""
        closed, states = twin.network.next_closed_form, twin.network.state_features
        count = len(twin.scaler.mean)
        weights = closed.weights.double().cpu().numpy()
        lags, rest = np.split(weights, [closed.lags * count])
        newest_first = lags.reshape(closed.lags, count, -1)[::-1, list(states)]
        carried = np.cumsum(newest_first, axis=0).transpose(0, 2, 1)
        carried = np.concatenate([np.zeros_like(carried[:1]), carried])
        first, second = np.triu_indices(count)
        products = np.zeros((weights.shape[1], count, count))
        products[:, first, second] = rest[: len(first)].T
        products = products + products.transpose(0, 2, 1)
        return cls(np.eye(len(states)) - carried, products, rest[len(first) : -1].T, tuple(states))

    def at(self, samples: NDArray[np.floating]) -> FloatArray:
        """Return (age, time, state feature, state feature) the response along one gapless run.

        ``samples`` (time, feature), scaled: what the closed form makes of a shift depends on where
        the machine was one step before, as products and squares of that sample are in it.
        """
        before = np.concatenate([samples[:1], samples[:-1]])
        response = np.repeat(self.linear[:, None], len(samples), axis=1)
        response[1:] -= self._slope(before)
        return response

    def carried(self, samples: NDArray[np.floating]) -> FloatArray:
        """Return (time, state feature, state feature) what the next forecast carries on.

        Column j is how it changes with feature j of the newest of ``samples`` (time, feature).
        """
        return np.asarray(self.linear[0] - self.linear[1] + self._slope(samples))

    def _slope(self, samples: NDArray[np.floating]) -> FloatArray:
        """Return (time, state feature, state feature) the derivative of products and squares."""
        known = np.nan_to_num(samples.astype(np.float64))
        states = list(self.states)
        products = self.products[:, states].reshape(-1, known.shape[1])
        slope = (known @ products.T).reshape(len(known), -1, len(states))
        slope += 2.0 * self.squares[:, states] * np.abs(known[:, None, states])
        return slope
