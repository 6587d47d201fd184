"""All detectors of a member speak of the same samples, and none learns from what it judges."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from odisar.baselines.range_rule import range_rule_scores
from odisar.capability.combined import ScoreSteps
from odisar.capability.innovations import InnovationSteps
from odisar.capability.outliers import NoiseSteps, SensorNoise
from odisar.capability.release import Release
from odisar.capability.scoring import DETECTORS, RecordingScores, Scorer
from odisar.capability.shifts import ShiftSteps, StateShift
from odisar.config.cases import RangeRule
from odisar.config.loader import load_config
from odisar.config.score import ScoreConfig
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.stages.detectors import (
    MemberDetectors,
    fit_innovation_scores,
    fit_relations,
    member_reference,
    score_steps,
)
from odisar.stages.members import MemberData
from small_bundle import small_case
from small_innovations import small_scorer
from small_system import make_recording

RULE = {"name": "speed-rule", "channel": "Speed", "min": 0.0, "max": 2.0}


@pytest.fixture(scope="module")
def data(trained_twin) -> MemberData:
    """Return the small system as a member has it; its test recordings must never be asked for."""
    splits = {
        "train": [make_recording(f"train-{i}") for i in range(3)],
        "validation": [make_recording(f"validation-{i}") for i in range(2)],
    }
    return MemberData(
        case=small_case(range_rules=[RULE]),
        splits=splits,
        scaler=trained_twin.scaler,
        spec=trained_twin.spec,
    )


def other_windows() -> ScoreConfig:
    """Return windows that are all told apart."""
    return ScoreConfig.model_validate(
        {
            "innovation": {
                "mean_steps": 7,
                "size_steps": 3,
                "recent_steps": 2,
                "recent_share": 0.2,
            },
            "consistency": {
                "mean_steps": 4,
                "size_steps": 5,
                "recent_steps": 1,
                "recent_share": 0.4,
            },
            "scatter": {"steps": 6, "share": 0.1},
            "noise": {"lasting_steps": 9, "recent_steps": 8, "recent_share": 0.6, "margin": 0.7},
            "shift": {"memory_steps": 11, "margin": 0.9},
            "release": {"steps": 12, "share": 0.8},
        }
    )


class Level:
    """A detector that says its samples' numbers."""

    def fit(self, reference):
        """Learn nothing."""

    def score(self, recordings):
        """Return the numbers."""
        return [np.arange(1.0, len(item.time_s) + 1) for item in recordings]


def asked_of(positions, scores):
    """Return a scorer that knows these scores alone."""
    unknown = np.zeros((len(positions), 1))
    runs = ((0, len(positions)),)
    known = RecordingScores(positions, scores, unknown, unknown, unknown, unknown, runs)
    return SimpleNamespace(score=lambda *_, **__: known)


def test_range_rules_and_alternatives_stand_beside_the_twins_scores_at_the_same_times(request):
    shipped = load_config(request.config.rootpath).cases["gunnerus"]
    rules = [
        shipped.range_rules[0],
        RangeRule(name="surge-rule", channel="Surge Speed", min=0.0, max=2.0),
    ]
    case = shipped.model_copy(update={"range_rules": rules})
    values = np.zeros((60, len(case.channels)))
    values[:, case.channel_names.index("Propeller Speed")] = 170.0
    values[40:, case.channel_names.index("Propeller Speed")] = 190.0
    values[:, case.channel_names.index("Surge Speed")] = 2.0
    recording = Recording("trial", RecordingInfo("gunnerus"), np.arange(60.0), values)
    positions = np.array([30, 49, 59])
    twin = asked_of(positions, {"odisar": np.array([0.1, np.nan, 0.3], dtype=np.float32)})
    detectors = MemberDetectors(SimpleNamespace(case=case), twin, {"level": Level()})
    scores, found = detectors.score(recording)
    assert scores.positions is positions
    assert list(found) == ["odisar", "level", "rpm-rule", "surge-rule"]
    np.testing.assert_allclose(found["odisar"], [0.1, np.nan, 0.3], rtol=1e-6)
    np.testing.assert_array_equal(found["level"], [31, 50, 60])
    np.testing.assert_allclose(found["rpm-rule"], [0.0, 1.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(found["surge-rule"], 1.0, atol=1e-6)
    assert {scores.dtype for scores in found.values()} == {np.dtype(np.float64)}


def test_every_detector_of_the_twin_each_alternative_and_each_rule_has_a_score(data, trained_twin):
    detectors = MemberDetectors.fit(data, small_scorer(trained_twin), seed=5)
    recording = make_recording("scored", 120)
    scores, found = detectors.score(recording)
    alternatives = ["mahalanobis", "pca-t2", "pca-spe", "rate-of-change", "stuck"]
    assert list(found) == [*DETECTORS, *alternatives, "speed-rule"]
    assert {len(values) for values in found.values()} == {len(scores.positions)}
    assert all(np.isfinite(values[20:]).all() for values in found.values())
    for name in DETECTORS:
        np.testing.assert_array_equal(found[name], scores.scores[name])
    rule = range_rule_scores(data.case.range_rules[0], recording, data.case, scores.positions)
    np.testing.assert_array_equal(found["speed-rule"], rule)


def test_alternatives_fitted_anew_give_the_same_bytes(data, trained_twin):
    scorer, recording = small_scorer(trained_twin), make_recording("scored", 120)
    first = MemberDetectors.fit(data, scorer, seed=5).score(recording)[1]
    again = MemberDetectors.fit(data, scorer, seed=5).score(recording)[1]
    assert {k: v.tobytes() for k, v in first.items()} == {k: v.tobytes() for k, v in again.items()}


def test_alternatives_learn_from_training_and_validation_recordings_alone(data):
    reference = member_reference(data, seed=5)
    assert [item.name for item in reference.train] == ["train-0", "train-1", "train-2"]
    assert [item.name for item in reference.held_out] == ["validation-0", "validation-1"]
    assert (reference.case, reference.spec) == (data.case, data.spec)


def test_innovation_scores_are_fitted_on_validation_recordings_from_their_second_window(
    data, trained_twin
):
    scorer = Scorer(trained_twin, 64, "cpu")
    case = data.case.model_copy(update={"score": other_windows()})
    whole = fit_innovation_scores(scorer, replace(data, case=case))
    fitted = whole.parts
    assert (fitted.consistency.mean.steps, fitted.consistency.size.steps) == (4, 5)
    assert fitted.consistency.reconstruction is None
    held_out = [
        scorer.score(item, short_lead_steps=3).samples for item in data.splits["validation"]
    ]
    assert fitted.share_holding == fitted.relations.share_holding(np.concatenate(held_out))
    assert (fitted.twin.mean.steps, fitted.closed_form.size.steps) == (7, 3)
    assert (fitted.twin.recent.steps, fitted.closed_form.recent_share) == (2, 0.2)
    assert (fitted.scatter.closed_form.steps, fitted.scatter.share) == (6, 0.1)
    assert fitted.twin.reconstruction is not None
    assert fitted.closed_form.reconstruction is None
    validation = [
        scorer.score(item, short_lead_steps=3).innovations[1:] for item in data.splits["validation"]
    ]
    moment = sum(run.T @ run for run in validation) / sum(map(len, validation))
    np.testing.assert_allclose(fitted.twin.size.precision, np.linalg.inv(moment), rtol=1e-4)
    assert not np.allclose(fitted.twin.size.precision, fitted.closed_form.size.precision, rtol=1e-3)


def test_the_steps_of_a_score_are_those_that_its_case_asks_for():
    assert score_steps(other_windows()) == ScoreSteps(
        innovation=InnovationSteps(mean=7, size=3, recent=2, recent_share=0.2),
        consistency=InnovationSteps(mean=4, size=5, recent=1, recent_share=0.4),
        scatter=6,
        scatter_share=0.1,
        noise=NoiseSteps(lasting=9, recent=8, recent_share=0.6, margin=0.7),
        shift=ShiftSteps(memory=11, margin=0.9),
        release=Release(steps=12, share=0.8),
    )


def test_noise_is_fitted_on_validation_recordings_by_the_closed_forms_precision(data, trained_twin):
    case = data.case.model_copy(update={"score": other_windows()})
    scorer = Scorer(trained_twin, 64, "cpu")
    fitted = fit_innovation_scores(scorer, replace(data, case=case))
    squares = [
        run.outliers(fitted.parts.closed_form.size.precision)
        for item in data.splits["validation"]
        for run in scorer.runs(item, scorer.score(item, short_lead_steps=3))
    ]
    assert fitted.noise == SensorNoise.fit(squares, NoiseSteps(9, 8, 0.6, 0.7))
    assert fitted.release == Release(12, 0.8)


def test_shifts_are_fitted_on_validation_recordings_or_not_sought(data, trained_twin):
    windows = other_windows()
    case = data.case.model_copy(update={"score": windows})
    scorer = Scorer(trained_twin, 64, "cpu")
    fitted = fit_innovation_scores(scorer, replace(data, case=case))
    runs = [
        run
        for item in data.splits["validation"]
        for run in scorer.runs(item, scorer.score(item, short_lead_steps=3))
    ]
    twin, closed = (
        [run.shifts(getattr(run, name), part.size.precision, 11) for run in runs]
        for name, part in (
            ("innovations", fitted.parts.twin),
            ("closed_form", fitted.parts.closed_form),
        )
    )
    assert fitted.shift == StateShift.fit(twin, closed, ShiftSteps(11, 0.9))
    case = data.case.model_copy(update={"score": windows.model_copy(update={"shift": None})})
    assert fit_innovation_scores(scorer, replace(data, case=case)).shift is None


def test_relations_are_fitted_on_training_recordings(data, trained_twin):
    relations = fit_relations(data, trained_twin)
    others = replace(data, splits={**data.splits, "train": data.splits["validation"]})
    assert relations.states == trained_twin.network.state_features
    assert not np.allclose(relations.weights, fit_relations(others, trained_twin).weights)
    later = replace(data, splits={"train": data.splits["train"]})
    np.testing.assert_array_equal(relations.weights, fit_relations(later, trained_twin).weights)
