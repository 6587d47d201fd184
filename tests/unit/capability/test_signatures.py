"""Blame falls on the state whose fault it is."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.assessment import Capability, Thresholds, blame_windows
from odisar.capability.responses import blamed_names
from odisar.capability.scoring import Scorer
from odisar.capability.signatures import Signatures, alarm_starts
from odisar.recordings.schema import Recording
from odisar.seeding import generator
from small_innovations import fit_scores, small_scorer
from small_reference import make_drive, turned
from small_system import CHANNELS, make_recording

#: Between two steps of the command.
ONSET = 124


@pytest.fixture(scope="module")
def scorer(trained_twin):
    return small_scorer(trained_twin)


def with_fault(recording: Recording, channel: int, kind: str, size: float) -> Recording:
    """Return the recording with a fault of one channel from ONSET on."""
    values = recording.values.copy()
    samples = len(values) - ONSET
    shapes = {
        "bias": np.ones(samples),
        "noise": generator(3, "noise", recording.name).normal(size=samples),
        "creep": 0.1 * np.arange(1, samples + 1),
    }
    values[ONSET:, channel] += size * shapes[kind]
    return replace(recording, values=values)


def blamed(scorer, recording: Recording, start: int, stop: int) -> list[str]:
    """Return who is blamed most at each sample."""
    scores = scorer.score(recording, short_lead_steps=3)
    windows = np.flatnonzero((scores.positions >= start) & (scores.positions < stop))
    blame = blame_windows(scorer, recording, scores, windows)
    names = blamed_names(scorer.twin)
    assert blame.shape == (len(windows), len(names))
    return [names[state] for state in blame.argmax(axis=1)]


@pytest.mark.parametrize("kind", ["bias", "noise"])
@pytest.mark.parametrize("channel", [1, 2])
def test_a_fault_of_one_state_is_blamed_on_it(scorer, channel, kind):
    found = []
    for number in range(3):
        faulty = with_fault(make_recording(f"faulty-{number}"), channel, kind, 0.2)
        found += blamed(scorer, faulty, ONSET, ONSET + 60)
    assert Counter(found)[CHANNELS[channel]] >= 0.9 * len(found)


def test_a_fault_of_one_state_is_blamed_on_it_by_the_assessments(scorer):
    capability = Capability(scorer, Thresholds(4.0, 9.0, 9.0), attribution_top=1)
    faulty = with_fault(make_recording("faulty"), 2, "bias", 0.3)
    scores = scorer.score(faulty, short_lead_steps=3)
    made = capability.assess(faulty, scores, stride_steps=1, step_s=1.0)
    flagged = [item for item in made if item.is_OOD and item.issued_s < ONSET + 20]
    assert len(flagged) >= 10
    assert {tuple(item.state_attribution) for item in flagged} == {("Turn Rate",)}


@pytest.fixture(scope="module")
def drive_scorer(drive_twin):
    fitted = fit_scores(drive_twin, [make_drive(f"fresh-{i}") for i in range(6)])
    return Scorer(drive_twin, 64, "cpu", fitted)


@pytest.mark.parametrize("kind", ["bias", "noise", "creep"])
@pytest.mark.parametrize(("channel", "name"), [(0, "position_x"), (1, "position_y")])
@pytest.mark.parametrize("angle", [0.0, 1.2, 2.5])
def test_a_fault_of_a_position_is_blamed_on_its_axis_of_the_map_whatever_the_heading(
    drive_scorer, angle, channel, name, kind
):
    found = []
    for number in range(4):
        drive = turned(make_drive(f"faulty-{number}"), angle)
        found += blamed(drive_scorer, with_fault(drive, channel, kind, 0.01), ONSET, ONSET + 10)
    shares = {who: count / len(found) for who, count in Counter(found).items()}
    # What is left falls on the velocity along the axis: few samples can't tell that apart.
    assert shares[name] > 0.6
    other = {"position_x": "position_y", "position_y": "position_x"}[name]
    assert shares.get(other, 0.0) < 0.1


def test_an_alarm_goes_on_over_a_short_gap():
    rare = np.zeros(16, dtype=bool)
    rare[[3, 5, 6, 12]] = True
    expected = [0, 1, 2, 3, 3, 3, 3, 3, 3, 9, 10, 11, 12, 12, 12, 15]
    assert alarm_starts(rare, 2).tolist() == expected


def test_after_a_gap_blame_begins_anew(scorer):
    recording = with_fault(make_recording("gap"), 1, "bias", 0.2)
    parted = replace(recording, segments=((0, 120), (120, 300)))
    later = replace(
        recording, time_s=recording.time_s[120:], values=recording.values[120:], segments=()
    )
    found = []
    for item, start in ((parted, 120), (later, 0)):
        scores = scorer.score(item, short_lead_steps=3)
        known = np.isfinite(scores.scores["odisar"]) & (scores.positions >= start)
        found.append(blame_windows(scorer, item, scores, np.flatnonzero(known)))
    assert len(found[0]) > 100
    np.testing.assert_allclose(*found, rtol=1e-4, atol=1e-5)


def test_blame_is_told_where_the_monitors_score_is_rare_run_by_run(scorer, monkeypatch):
    told = []

    def blame(_, innovations, samples, windows, directions, is_rare):
        told.append(is_rare)
        assert len(innovations) == len(samples) == len(directions) == len(is_rare)
        return np.zeros((len(windows), 2))

    monkeypatch.setattr(Signatures, "blame", blame)
    recording = with_fault(make_recording("gap"), 1, "bias", 0.2)
    parted = replace(recording, segments=((0, 120), (120, 300)))
    scores = scorer.score(parted, short_lead_steps=3)
    blame_windows(scorer, parted, scores, np.arange(len(scores.positions)))
    found = np.concatenate(told)
    np.testing.assert_array_equal(found, scores.scores["odisar"] >= np.e)
    assert [len(run) for run in told] == [stop - start for start, stop in scores.runs]
    assert 0 < found.sum() < len(found)


def test_of_no_windows_nobody_is_blamed(scorer):
    recording = make_recording("short", 15)
    scores = scorer.score(recording, short_lead_steps=3)
    assert blame_windows(scorer, recording, scores, np.empty(0, dtype=np.int64)).shape == (0, 2)
