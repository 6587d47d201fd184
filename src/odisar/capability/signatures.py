"""Which state to blame for innovations: the one whose fault would explain most of them.

For every state, the part of a statistic that a change of this state alone takes away: the
generalised likelihood ratio of a change along the state's *signature* (Alcala and Qin,
Automatica 2009, call it a reconstruction-based contribution). The signature of noise is the state
itself. A bias shows as the state itself in its first sample; afterwards the forecasts are made
from biased samples, and what stays is the bias less what the closed form carries on of it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.capability.innovations import FloatArray, InnovationScore, moving_mean
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin

#: A direction that is not seen at all explains nothing; keeps 0 / 0 out.
_SMALLEST = 1.0e-12


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


def lasting_response(twin: TrainedTwin) -> FloatArray:
    """Return (state feature, state feature) the innovation that a lasting shift of one leaves.

    Column j is what stays, in every feature, of a unit shift of feature j: the shift less what
    the linear part of the closed form makes of it.
    """
    closed = twin.network.next_closed_form
    count = len(twin.scaler.mean)
    features = list(twin.network.state_features)
    lags = closed.weights[: closed.lags * count].double().cpu().numpy()
    carried = lags.reshape(closed.lags, count, -1).sum(axis=0)[features]
    return np.asarray(np.eye(len(features)) - carried.T)


@dataclass(frozen=True)
class Signatures:
    """Attribution of an innovation score; ``lasting`` as ``lasting_response`` gives it."""

    score: InnovationScore
    lasting: FloatArray

    @classmethod
    def of(cls, twin: TrainedTwin, score: InnovationScore) -> "Signatures":
        """Return the signatures of a twin."""
        return cls(score, lasting_response(twin))

    def blame(
        self, innovations: FloatArray, windows: NDArray[np.int64], directions: FloatArray
    ) -> FloatArray:
        """Return (window, state) how much of the score each state explains, in standard deviations.

        ``innovations`` (time, state feature) are one gapless run, ``windows`` which of its times
        are asked for, ``directions`` (window, state, state feature) of those. Of the mean and the
        size the rarer one is explained: the mean by biases, the size by noise.
        """
        leads = self.score.parts(innovations)[:, windows].argmax(axis=0)
        mean, size = self.score.mean, self.score.size
        means = moving_mean(innovations, mean.steps)[windows]
        onset = _explained(means, directions, mean.precision)
        later = _explained(means, directions @ self.lasting.T, mean.precision)
        lean = np.maximum(onset, later)
        back = np.maximum(windows[:, None] - np.arange(size.steps), 0)
        scatter = np.mean(
            [_explained(innovations[at], directions, size.precision) for at in back.T], axis=0
        )
        return np.sqrt(np.where(leads[:, None] == 0, lean, scatter))


def _explained(
    innovations: FloatArray, directions: FloatArray, precision: FloatArray
) -> FloatArray:
    """Return (window, state) the squared distance that a change along each direction takes away."""
    along = np.einsum("wsf,fg,wg->ws", directions, precision, innovations)
    size = np.einsum("wsf,fg,wsg->ws", directions, precision, directions)
    return np.asarray(along**2 / np.maximum(size, _SMALLEST))
