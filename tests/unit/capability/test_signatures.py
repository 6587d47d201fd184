"""Blame falls on the state whose fault it is."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.capability.assessment import Capability, Thresholds, blame_windows
from odisar.capability.combined import InnovationScores
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import InnovationScore
from odisar.capability.scoring import Scorer
from odisar.capability.signatures import (
    StepResponse,
    alarm_starts,
    blamed_names,
    state_directions,
)
from odisar.config.loader import load_config
from odisar.forecasters.closed_form import design
from odisar.recordings.schema import Recording
from odisar.seeding import generator
from odisar.twin.bundle import TrainedTwin
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.transformer import TwinTransformer
from odisar.windows.coordinates import features
from odisar.windows.window_set import WindowSet
from small_bundle import small_case
from small_innovations import STEPS, runs_of, small_scorer
from small_reference import drive_reference, make_drive
from small_system import CHANNELS, SPEC, make_recording

#: Between two steps of the command.
ONSET = 124


@pytest.fixture(scope="module")
def scorer(trained_twin):
    return small_scorer(trained_twin)


def relative_case():
    channels = [channel.model_dump() | {"role": "state"} for channel in small_case().channels]
    channels[0]["unit"] = "rad"
    pose = {"x": "Speed", "y": "Turn Rate", "heading": ["Command"], "coordinates": "relative"}
    return small_case(channels=channels, pose=pose)


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


def test_whoever_can_be_blamed_is_named_as_the_case_names_them(trained_twin, relative_twin):
    assert list(blamed_names(trained_twin)) == small_case().blamed_names == ["Speed", "Turn Rate"]
    names = ["Speed", "Turn Rate", "Command"]
    assert list(blamed_names(relative_twin)) == relative_case().blamed_names == names


def test_a_heading_of_two_channels_is_one_state(request):
    shipped = load_config(request.config.rootpath).cases["robot"]
    heading = " / ".join(shipped.pose.heading)
    assert len(shipped.pose.heading) == 2
    assert shipped.blamed_names[:3] == [shipped.pose.x, shipped.pose.y, heading]


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
def drive_scorer(plan):
    """Return a scorer of drives whose twin is its closed form: nothing has trained it."""
    reference = drive_reference()
    spec, names = reference.spec, tuple(reference.case.channel_names)
    network = TwinTransformer(plan.twin, spec, len(names))
    network.fit_closed_forms(WindowSet(reference.train, reference.scaler, spec))
    masks = draw_masks(network, 2, "all", 3)
    twin = TrainedTwin(network.eval(), plan.twin, spec, reference.scaler, masks, names)
    scored = [
        Scorer(twin, 64, "cpu").score(make_drive(f"fresh-{i}"), short_lead_steps=5)
        for i in range(6)
    ]
    runs = [run for scores in scored for run in runs_of(scores, scores.innovations)]
    score = InnovationScore.fit(runs, None, STEPS)
    relations = Consistency.fit(scored[0].samples, twin.network.state_features)
    return Scorer(twin, 64, "cpu", InnovationScores(score, score, score, relations, 1.0))


def turned(drive: Recording, angle: float) -> Recording:
    """Return the drive as it is on a map that is turned by an angle in radians."""
    values = drive.values.copy()
    x, y = drive.values[:, :2].T
    values[:, 0] = np.cos(angle) * x - np.sin(angle) * y
    values[:, 1] = np.sin(angle) * x + np.cos(angle) * y
    half = np.arctan2(values[:, 2], values[:, 3]) + angle / 2
    values[:, 2], values[:, 3] = np.sin(half), np.cos(half)
    return replace(drive, values=values)


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


def test_a_direction_is_how_a_shift_enters_the_features(relative_twin):
    """Without a turn in between, the rates of a shifted sample differ by the direction itself."""
    recording = make_recording("shifted")
    values = recording.values.copy()
    values[:, 0] = np.repeat(np.linspace(-3, 3, 10), 30)
    base = replace(recording, values=values)
    positions = np.arange(20, 300, 30)
    directions = state_directions(relative_twin, base, positions)
    assert directions.shape == (10, 3, 3)
    scale = relative_twin.scaler.scale
    for state, channel in enumerate((1, 2)):
        for at, direction in zip(positions, directions[:, state], strict=True):
            shifted = base.values.copy()
            shifted[at:, channel] += 0.5
            seen = [
                scale(features(replace(base, values=v), relative_twin.spec.pose))[at]
                for v in (shifted, base.values)
            ]
            np.testing.assert_allclose(seen[0] - seen[1], 0.5 * direction, atol=1e-4)


def test_without_a_pose_a_state_is_its_own_feature(trained_twin):
    directions = state_directions(trained_twin, make_recording("a"), np.array([30, 40]))
    wanted = np.diag(1 / trained_twin.scaler.std[1:])
    np.testing.assert_allclose(directions, [wanted, wanted])


def test_a_step_leaves_what_the_closed_form_does_not_carry_on_from_where_the_machine_is(
    trained_twin,
):
    network = trained_twin.network
    closed, random = network.next_closed_form, generator(4, "where")
    samples = random.normal(size=(30, len(CHANNELS)))
    response = StepResponse.of(trained_twin).at(samples)
    features = network.state_features
    assert response.shape == (closed.lags + 1, 30, len(features), len(features))
    now, small = 29, 1e-4
    context = torch.from_numpy(samples[None, now - SPEC.context_steps : now])
    forecast = design(context, closed.lags) @ closed.weights.double()
    for age in range(closed.lags + 1):
        for column, feature in enumerate(features):
            shifted = context.clone()
            shifted[:, SPEC.context_steps - age :, feature] += small
            moved = design(shifted, closed.lags) @ closed.weights.double() - forecast
            left = -moved[0].numpy() / small
            left[column] += 1.0
            np.testing.assert_allclose(response[age, now, :, column], left, atol=1e-3)


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


def test_of_no_windows_nobody_is_blamed(scorer):
    recording = make_recording("short", 15)
    scores = scorer.score(recording, short_lead_steps=3)
    assert blame_windows(scorer, recording, scores, np.empty(0, dtype=np.int64)).shape == (0, 2)
