"""Which state to blame for innovations: the one whose fault would explain most of them.

For every state, the part of a squared distance that a change of this state alone takes away: the
generalised likelihood ratio of a change along the state's *signature* (Alcala and Qin,
Automatica 2009, call it a reconstruction-based contribution). The signature is a step response:
in its first sample a fault shows in its own state alone; afterwards the forecasts are made from
faulty samples, and what stays is the step less what the closed form carries on of it. What stays
can be the same for two states that physics ties (a velocity that reads too high, a position that
creeps), so the onset is remembered for as long as the alarm lasts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.capability.innovations import FloatArray, InnovationScore
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin

#: A direction that is not seen at all explains nothing; keeps 0 / 0 out.
_SMALLEST = 1.0e-12
#: So many samples of a step response tell states apart before what stays of it takes over.
_ONSET_STEPS = 3


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


def step_response(twin: TrainedTwin) -> FloatArray:
    """Return (step, state feature, state feature) the innovations that a lasting shift leaves.

    Column j of the first is what shows, in every feature, of a unit shift of feature j when it
    sets in; of the next what shows one step later; of the last what stays: the shift less what
    the linear part of the closed form makes of its earlier samples.
    """
    closed = twin.network.next_closed_form
    count = len(twin.scaler.mean)
    features = list(twin.network.state_features)
    lags = closed.weights[: closed.lags * count].double().cpu().numpy()
    newest_first = lags.reshape(closed.lags, count, -1)[::-1, features]
    carried = np.cumsum(newest_first, axis=0).transpose(0, 2, 1)
    return np.asarray(np.eye(len(features)) - np.concatenate([np.zeros_like(carried[:1]), carried]))


@dataclass(frozen=True)
class Signatures:
    """Attribution of an innovation score; ``response`` as ``step_response`` gives it."""

    score: InnovationScore
    response: FloatArray

    @classmethod
    def of(cls, twin: TrainedTwin, score: InnovationScore) -> "Signatures":
        """Return the signatures of a twin."""
        return cls(score, step_response(twin))

    def blame(
        self, innovations: FloatArray, windows: NDArray[np.int64], directions: FloatArray
    ) -> FloatArray:
        """Return (window, state) how much of what is seen each state explains, in std deviations.

        ``innovations`` (time, state feature) are one gapless run, ``windows`` which of its times
        are asked for, ``directions`` (time, state, state feature) those of ``state_directions``.
        What a state explains is the sum of two squares: of the mean of the last innovations, and
        of the onset of the current alarm.
        """
        return np.sqrt(
            self._of_mean(innovations, windows, directions[windows])
            + self._of_onset(innovations, windows, directions)
        )

    def _of_mean(
        self, innovations: FloatArray, windows: NDArray[np.int64], directions: FloatArray
    ) -> FloatArray:
        mean = self.score.mean
        means = mean.means(innovations)[windows]
        ends = [directions @ response.T for response in (self.response[0], self.response[-1])]
        explained = [_explained(means, end, mean.precision) for end in ends]
        return np.asarray(np.max(explained, axis=0))

    def _of_onset(
        self, innovations: FloatArray, windows: NDArray[np.int64], directions: FloatArray
    ) -> FloatArray:
        """Return (window, state) the most that a step explains which set in during the alarm."""
        jumps = self._jumps(np.nan_to_num(innovations), directions)
        # What is rare now may have set in when the oldest sample that is looked at came.
        memory = max(self.score.mean.steps, self.score.size.steps)
        lead_in = memory + len(jumps) - 1
        starts = alarm_starts(self.score.parts(innovations).max(axis=0) >= 1, memory)
        found = np.zeros((len(windows), directions.shape[1]))
        for row, window in enumerate(windows):
            first = max(0, int(starts[window]) - lead_in)
            for length, jump in enumerate(jumps, start=1):
                # Of the last steps only the beginning is known yet.
                end = max(0, window - length + 2)
                own = jump[first if length == len(jumps) else max(first, end - 1) : end]
                found[row] = np.maximum(found[row], own.max(axis=0, initial=0.0))
        return found

    def _jumps(self, innovations: FloatArray, directions: FloatArray) -> list[FloatArray]:
        """Return (time, state) what a step that sets in there explains of the samples after it.

        One for each number of samples that are looked at, up to ``_ONSET_STEPS``.
        """
        precision, count = self.score.size.precision, len(innovations)
        along = np.zeros(directions.shape[:2])
        size = np.zeros(directions.shape[:2])
        jumps = []
        for step, response in enumerate(self.response[:_ONSET_STEPS]):
            shown = directions @ response.T @ precision
            later = np.zeros_like(innovations)
            later[: max(0, count - step)] = innovations[step:]
            along = along + np.einsum("tsf,tf->ts", shown, later)
            size = size + np.einsum("tsf,tsf->ts", shown, directions @ response.T)
            jumps.append(along**2 / np.maximum(size, _SMALLEST))
        return jumps


def alarm_starts(is_rare: NDArray[np.bool_], gap_steps: int) -> NDArray[np.int64]:
    """Return (time,) where the current alarm began, or now where there is none.

    An alarm is a stretch of times that are rare, or no further than ``gap_steps`` behind one.
    """
    times = np.arange(len(is_rare))
    last = np.maximum.accumulate(np.where(is_rare, times, -gap_steps - 1))
    in_alarm = times - last <= gap_steps
    begins = in_alarm & ~np.concatenate([[False], in_alarm[:-1]])
    started = np.maximum.accumulate(np.where(begins, times, 0))
    return np.asarray(np.where(in_alarm, started, times))


def _explained(
    innovations: FloatArray, directions: FloatArray, precision: FloatArray
) -> FloatArray:
    """Return (window, state) the squared distance that a change along each direction takes away."""
    along = np.einsum("wsf,fg,wg->ws", directions, precision, innovations)
    size = np.einsum("wsf,fg,wsg->ws", directions, precision, directions)
    return np.asarray(along**2 / np.maximum(size, _SMALLEST))
