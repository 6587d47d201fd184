"""Probes: change what may not move a score, and what must, and see whether the score moves.

Kaufman, Rosset, Perlich and Stitelman (2012, ACM TKDD 6(4)) call leakage what a model knows at
learning or scoring time that it could not know in use. Reading code finds little of it; changing
the forbidden input and comparing scores finds whatever the change reaches.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from odisar.evaluation.own_model import Score, checked_scores
from odisar.recordings.schema import UNDISTURBED, Interval, Recording
from odisar.seeding import generator

FloatArray = NDArray[np.float64]

#: Names of the probes; see ``PROBES`` for what each one does.
REPEAT, FUTURE, TRUNCATION = "repeat", "future", "truncation"
BATCH, LABELS, CONTROL = "batch", "labels", "control"

# Far outside anything recorded, so that a leak that is faint on usual samples shows.
_PUSH_SIGMAS = 100.0


@dataclass(frozen=True)
class Comparison:
    """One change, and how far a recording's score moved by it.

    Attributes
    ----------
    change
        What was changed.
    recording
        Whose score was compared.
    sample
        The sample t that the change refers to; None where it refers to the whole recording.
    moved
        Whether the score moved where it was compared, by more than was tolerated.
    largest_change
        Largest change of the score, in the score's units; inf where a score came or went.
    at_sample
        Where that was.
    waited_steps
        Of the control: after how many samples the score first moved, or None if it never did.
    """

    change: str
    recording: str
    sample: int | None
    moved: bool
    largest_change: float
    at_sample: int
    waited_steps: int | None = None


@dataclass(frozen=True)
class Subject:
    """A scorer under probe, and what it says of each recording alone.

    ``alone`` holds (sample,) scores by recording, ``positions`` the samples t by recording,
    ``std`` (channel,) one sigma in physical units, ``states`` the channels that are no commands.
    A change up to ``tolerated_change`` (in the score's units) is no move.
    """

    name: str
    score: Score
    recordings: tuple[Recording, ...]
    alone: tuple[FloatArray, ...]
    positions: tuple[tuple[int, ...], ...]
    std: FloatArray
    states: tuple[int, ...]
    seed: int
    control_delay_steps: int
    tolerated_change: float

    def places(self) -> Iterator[tuple[int, int]]:
        """Return every recording's index with every sample t that is probed in it."""
        for index, positions in enumerate(self.positions):
            for position in positions:
                yield index, position

    def other_samples(self, index: int) -> FloatArray:
        """Return (sample, channel) of another recording (of this one, backwards, if alone).

        Repeated or cut to this recording's length.
        """
        own = self.recordings[index].values
        others = [r.values for k, r in enumerate(self.recordings) if k != index]
        source = others[index % len(others)] if others else own[::-1]
        return np.take(source, np.arange(len(own)), axis=0, mode="wrap")

    def scores_of(self, recordings: Sequence[Recording]) -> list[FloatArray]:
        """Return (sample,) scores of recordings in one call, on copies that may be overwritten."""
        taken = [copied(recording) for recording in recordings]
        return checked_scores(self.name, self.score(taken), taken)

    def compare_alone(
        self, index: int, changed: Recording, change: str, sample: int | None = None
    ) -> Comparison:
        """Score a changed recording alone and compare it with what the unchanged one had."""
        return self.compare(index, self.scores_of([changed])[0], change, sample)

    def compare(
        self, index: int, after: FloatArray, change: str, sample: int | None = None
    ) -> Comparison:
        """Compare (sample,) scores of a recording, up to t if there is one, with those it had."""
        stop = len(after) if sample is None else sample + 1
        changes = score_changes(self.alone[index][:stop], after[:stop])
        at = int(np.argmax(changes))
        largest = float(changes[at])
        name = self.recordings[index].name
        return Comparison(change, name, sample, largest > self.tolerated_change, largest, at)


def score_changes(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return (sample,) absolute changes of (sample,) scores; inf where a NaN came or went."""
    same = (before == after) | (np.isnan(before) & np.isnan(after))
    with np.errstate(invalid="ignore"):
        changes = np.where(same, 0.0, np.abs(after - before))
    return np.where(np.isnan(changes), np.inf, changes)


def probe_repeat(subject: Subject) -> Iterator[Comparison]:
    """Ask twice about the very same recording: noise, memory and overwritten samples show."""
    for index, recording in enumerate(subject.recordings):
        taken = copied(recording)
        subject.score([taken])
        again = checked_scores(subject.name, subject.score([taken]), [taken])
        yield subject.compare(index, again[0], "asked again")


def probe_future(subject: Subject) -> Iterator[Comparison]:
    """Change every sample after t in several ways: no score up to t may move."""
    for index, position in subject.places():
        for change, values in _other_futures(subject, index, position):
            changed = replace(subject.recordings[index], values=values)
            yield subject.compare_alone(index, changed, change, position)


def probe_truncation(subject: Subject) -> Iterator[Comparison]:
    """End the recording at t, as a stream does: no score up to t may move."""
    for index, position in subject.places():
        ended = cut_after(subject.recordings[index], position)
        yield subject.compare_alone(index, ended, "recording ended after", position)


def probe_batch(subject: Subject) -> Iterator[Comparison]:
    """Give a recording other company in the same call: its score must be the one it has alone."""
    for index, recording in enumerate(subject.recordings):
        for change, company in _companies(subject, index):
            place = next(k for k, member in enumerate(company) if member is recording)
            yield subject.compare(index, subject.scores_of(company)[place], change)


def probe_labels(subject: Subject) -> Iterator[Comparison]:
    """Take the labels away, and invent some: no score may move."""
    for index, recording in enumerate(subject.recordings):
        middle, end = recording.time_s[len(recording.time_s) // 2], recording.time_s[-1]
        invented = (Interval(float(middle), float(end), "invented"),)
        stripped = _labelled(recording, (), UNDISTURBED, None)
        yield subject.compare_alone(index, stripped, "labels taken away")
        labelled = _labelled(recording, invented, "invented", 1.0)
        yield subject.compare_alone(index, labelled, "labels invented")


def probe_control(subject: Subject) -> Iterator[Comparison]:
    """Move the states at t by one sigma: the score must move at t, or within the stated delay."""
    for index, position in subject.places():
        recording = subject.recordings[index]
        values = recording.values.copy()
        values[position, list(subject.states)] += subject.std[list(subject.states)]
        changed = replace(recording, values=values)
        after = subject.scores_of([changed])[0]
        changes = score_changes(subject.alone[index], after)[position:]
        moved = np.flatnonzero(changes > subject.tolerated_change)
        in_time = changes[: subject.control_delay_steps + 1]
        at = int(np.argmax(in_time))
        yield Comparison(
            change="states moved by one sigma at",
            recording=recording.name,
            sample=position,
            moved=bool(in_time[at] > subject.tolerated_change),
            largest_change=float(in_time[at]),
            at_sample=position + at,
            waited_steps=int(moved[0]) if moved.size else None,
        )


#: The probes by name, in the order in which a report tells them.
PROBES: Mapping[str, Callable[[Subject], Iterator[Comparison]]] = {
    REPEAT: probe_repeat,
    FUTURE: probe_future,
    TRUNCATION: probe_truncation,
    BATCH: probe_batch,
    LABELS: probe_labels,
    CONTROL: probe_control,
}


def copied(recording: Recording) -> Recording:
    """Return a recording with samples of its own."""
    return replace(recording, time_s=recording.time_s.copy(), values=recording.values.copy())


def cut_after(recording: Recording, position: int) -> Recording:
    """Return a recording as it was when sample ``position`` was its last."""
    stop = position + 1
    segments = tuple((a, min(b, stop)) for a, b in recording.segments if a < stop)
    return replace(
        recording,
        time_s=recording.time_s[:stop],
        values=recording.values[:stop],
        segments=segments,
    )


def _other_futures(subject: Subject, index: int, position: int) -> Iterator[tuple[str, FloatArray]]:
    """Yield changes with the (sample, channel) values of a recording whose samples after t differ.

    One command or one state alone is pushed too: a detector may clip or ignore a push of all.
    """
    recording = subject.recordings[index]
    random = generator(subject.seed, "leakage", recording.name, position)
    later = slice(position + 1, None)
    replaced = recording.values.copy()
    replaced[later] = subject.other_samples(index)[later]
    yield "others' samples in place of those after", replaced
    channels = list(range(len(subject.std)))
    pushes = [("all channels", channels)]
    for role, members in (
        ("command", [i for i in channels if i not in subject.states]),
        ("state", list(subject.states)),
    ):
        if members:
            chosen = int(random.choice(members))
            pushes.append((f"channel {chosen} (a {role})", [chosen]))
    for pushed, positions in pushes:
        values = recording.values.copy()
        push = random.choice([-_PUSH_SIGMAS, _PUSH_SIGMAS])
        values[later, positions] += push * subject.std[positions]
        yield f"{pushed} pushed after", values


def _companies(subject: Subject, index: int) -> Iterator[tuple[str, list[Recording]]]:
    """Yield changes with the recordings of a call; the recording itself is always among them."""
    recording = subject.recordings[index]
    stranger = replace(
        recording,
        name=f"{recording.name} (changed)",
        values=subject.other_samples(index) + _PUSH_SIGMAS * subject.std,
    )
    company = list(subject.recordings)
    yield "one recording added after it", [recording, stranger]
    yield "one recording added before it", [stranger, recording]
    if len(company) == 1:
        return
    yield "all recordings in one call", company
    yield "recordings in reverse order", company[::-1]
    yield (
        "the other recordings changed",
        [
            member
            if member is recording
            else replace(member, values=member.values + _PUSH_SIGMAS * subject.std)
            for member in company
        ],
    )
    if len(company) > 2:
        left_out = company[index - 1]
        yield "one recording removed", [member for member in company if member is not left_out]


def _labelled(
    recording: Recording,
    intervals: tuple[Interval, ...],
    disturbance: str,
    strength: float | None,
) -> Recording:
    info = replace(
        recording.info, disturbance=disturbance, components=disturbance, strength=strength
    )
    return replace(recording, info=info, intervals=intervals)
