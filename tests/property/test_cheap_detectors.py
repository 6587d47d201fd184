"""What each of the cheap alternatives must be: causal, alone with its recording, repeatable."""

from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odisar.baselines.interface import Detector
from odisar.baselines.registry import cheap_detectors, optional_detectors
from odisar.recordings.schema import Recording
from small_reference import (
    CONTEXT,
    changed,
    drive_case,
    drive_reference,
    make_drive,
    system_case,
    system_reference,
)
from small_system import make_recording

SAMPLES = 120
SYSTEMS = {
    "system": (system_case, system_reference, make_recording),
    "drive": (drive_case, drive_reference, make_drive),
}
NEEDS_PYOD = pytest.mark.skipif(find_spec("pyod") is None, reason="PyOD comes with the study")


def detectors(system: str) -> dict[str, Detector]:
    return cheap_detectors(SYSTEMS[system][0]()) | optional_detectors()


def fitted(system: str, name: str) -> Detector:
    detector = detectors(system)[name]
    detector.fit(SYSTEMS[system][1]())
    return detector


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(
            (system, name),
            id=f"{system}-{name}",
            marks=[NEEDS_PYOD] if name == "isolation-forest" else [],
        )
        for system in SYSTEMS
        for name in detectors(system)
    ],
)
def subject(request) -> tuple[str, str, Detector]:
    return *request.param, fitted(*request.param)


def recording_of(system: str, name: str = "scored", samples: int = SAMPLES) -> Recording:
    return SYSTEMS[system][2](name, samples)


def first_scored(system: str) -> int:
    """Return the first sample with a whole context: one later where rates need a sample before."""
    return CONTEXT - 1 + (system == "drive")


@settings(max_examples=15, deadline=None)
@given(at=st.integers(CONTEXT + 1, SAMPLES - 2), push=st.floats(-1e3, 1e3), data=st.data())
def test_nothing_after_t_moves_a_score_at_or_before_t(subject, at, push, data):
    system, _, detector = subject
    recording = recording_of(system)
    values = recording.values.copy()
    values[at + 1 :, data.draw(st.integers(0, values.shape[1] - 1))] += push
    before, after = detector.score([recording])[0], detector.score([changed(recording, values)])[0]
    np.testing.assert_array_equal(before[: at + 1], after[: at + 1])


@settings(max_examples=10, deadline=None)
@given(
    lengths=st.lists(st.integers(5, 150), max_size=4),
    place=st.integers(0, 4),
    push=st.floats(-99, 99),
)
def test_other_recordings_of_the_call_do_not_matter(subject, lengths, place, push):
    system, _, detector = subject
    others = [recording_of(system, f"other-{i}", samples) for i, samples in enumerate(lengths)]
    others = [changed(other, other.values + push) for other in others]
    place = min(place, len(others))
    alone = detector.score([recording_of(system)])[0]
    among = detector.score([*others[:place], recording_of(system), *others[place:]])[place]
    np.testing.assert_array_equal(alone, among)


@settings(max_examples=10, deadline=None)
@given(push=st.floats(-1e3, 1e3), start=st.integers(0, SAMPLES - 1))
def test_scores_begin_with_the_first_whole_context_and_are_finite_and_positive(
    subject, push, start
):
    system, _, detector = subject
    recording = recording_of(system)
    values = recording.values.copy()
    values[start:] += push
    scores = detector.score([changed(recording, values)])[0]
    first = first_scored(system)
    assert scores.shape == (SAMPLES,)
    assert np.isnan(scores[:first]).all()
    assert np.isfinite(scores[first:]).all()
    assert np.all(scores[first:] > 0)


@settings(max_examples=10, deadline=None)
@given(gap=st.integers(1, SAMPLES - 1))
def test_after_a_gap_a_recording_begins_anew(subject, gap):
    system, _, detector = subject
    recording = recording_of(system)
    parted = changed(recording, recording.values, ((0, gap), (gap, SAMPLES)))
    parts = [
        Recording(part, recording.info, recording.time_s[cut], recording.values[cut])
        for part, cut in {"before": slice(gap), "after": slice(gap, None)}.items()
    ]
    whole = detector.score([parted])[0]
    # Matrix products of other sizes may round their sums otherwise.
    np.testing.assert_allclose(whole, np.concatenate(detector.score(parts)), rtol=1e-9)


def test_a_recording_as_short_as_its_context_has_one_score(subject):
    system, _, detector = subject
    samples = first_scored(system) + 1
    scores = detector.score([recording_of(system, samples=samples)])[0]
    assert np.flatnonzero(np.isfinite(scores)).tolist() == [samples - 1]


def test_what_happens_at_t_is_seen_at_t(subject):
    system, name, detector = subject
    recording, at = recording_of(system), 70
    values = recording.values.copy()
    if name == "stuck":
        values[at - 5 : at + 1] = values[at]
    else:
        values[at] += 2 * values.std(axis=0)
    before, after = detector.score([recording])[0], detector.score([changed(recording, values)])[0]
    assert abs(after[at] / before[at] - 1) > 1e-3


def test_fitting_again_gives_the_same_bytes(subject):
    system, name, detector = subject
    recording = recording_of(system)
    once, again = detector.score([recording])[0], fitted(system, name).score([recording])[0]
    assert once.tobytes() == again.tobytes()
