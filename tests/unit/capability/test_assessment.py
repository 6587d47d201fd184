import json

import jsonschema
import numpy as np
import pytest

from odisar.capability.assessment import (
    Capability,
    Thresholds,
    assessment_schema,
    assessments_json,
    reported_windows,
)
from odisar.capability.quadrants import Quadrant, quadrant
from odisar.capability.scores import (
    predictive_variance,
    reconstruction_error,
    state_reconstruction_errors,
)
from odisar.capability.scoring import Scorer
from odisar.capability.thresholds import sigma_threshold
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from small_innovations import small_scorer
from small_system import make_recording

LIMITS = Thresholds(score=4.0, reconstruction=0.1, variance=0.01)


def assess(trained_twin, thresholds, recording=None):
    recording = recording or make_recording("assessed", push=0.5)
    scorer = small_scorer(trained_twin)
    scores = scorer.score(recording, short_lead_steps=5)
    capability = Capability(scorer, thresholds, attribution_top=3)
    return capability.assess(recording, scores, stride_steps=10, step_s=1.0)


def test_scores_are_the_papers_formulas():
    random = np.random.default_rng(0)
    forecast, reconstruction = random.normal(size=(2, 4, 10, 3))
    states = state_reconstruction_errors(forecast, reconstruction)
    by_hand = np.sqrt(((reconstruction - forecast) ** 2).sum(axis=1) / 10)
    np.testing.assert_allclose(states, by_hand)
    whole = np.sqrt(((reconstruction - forecast) ** 2).mean(axis=(1, 2)))
    np.testing.assert_allclose(reconstruction_error(states), whole)
    draws = random.normal(size=(5, 4, 10, 3))
    population = ((draws - draws.mean(axis=0)) ** 2).sum(axis=0) / 5
    np.testing.assert_allclose(predictive_variance(draws), population.mean(axis=(1, 2)))


def test_threshold_is_mean_plus_k_population_sigma():
    assert sigma_threshold(np.array([1.0, 3.0, np.nan]), 3.0) == pytest.approx(2 + 3 * 1)
    with pytest.raises(OdisarError, match="1 calibration scores cannot set a threshold"):
        sigma_threshold(np.array([1.0, np.nan]), 3.0)


@pytest.mark.parametrize(
    ("is_ood", "is_uncertain", "expected"),
    [
        (False, False, Quadrant.IND_CONFIDENT),
        (False, True, Quadrant.IND_UNCERTAIN),
        (True, True, Quadrant.OOD_UNCERTAIN),
        (True, False, Quadrant.OOD_CONFIDENT),
    ],
)
def test_two_flags_make_a_quadrant(is_ood, is_uncertain, expected):
    assert quadrant(is_ood=is_ood, is_uncertain=is_uncertain) is expected


def test_an_uncalibrated_capability_refuses_to_answer(trained_twin):
    with pytest.raises(OdisarError, match="not calibrated and refuses"):
        assess(trained_twin, None)


def test_a_capability_without_fitted_innovations_refuses_to_answer(trained_twin):
    scorer = Scorer(trained_twin, 64, "cpu")
    recording = make_recording("assessed")
    scores = scorer.score(recording, short_lead_steps=5)
    with pytest.raises(OdisarError, match="not calibrated and refuses"):
        Capability(scorer, LIMITS, attribution_top=3).assess(
            recording, scores, stride_steps=10, step_s=1.0
        )


def test_every_flag_follows_from_its_score_and_threshold(trained_twin):
    made = assess(trained_twin, LIMITS)
    assert {item.is_OOD for item in made} == {True, False}
    assert {item.recon_exceeds_threshold for item in made} == {True, False}
    assert {item.uncertainty_exceeds_threshold for item in made} == {True, False}
    for item in made:
        assert item.is_OOD == item.score_exceeds_threshold == (item.score > 4.0)
        assert item.recon_exceeds_threshold == (item.reconstruction_error > 0.1)
        assert item.uncertainty_exceeds_threshold == (item.uncertainty_variance > 0.01)
        for blame, flag in (
            (item.state_attribution, item.is_OOD),
            (item.reconstruction_attribution, item.recon_exceeds_threshold),
        ):
            assert bool(blame) == flag
            blamed = list(blame.values())
            assert blamed == sorted(blamed, reverse=True)


def test_the_papers_flag_neither_makes_nor_breaks_an_assessment(trained_twin):
    by_score = assess(trained_twin, Thresholds(score=4.0, reconstruction=9.0, variance=0.01))
    assert [item.is_OOD for item in by_score] == [
        item.is_OOD for item in assess(trained_twin, LIMITS)
    ]
    assert not any(item.reconstruction_attribution for item in by_score)


def test_the_horizon_of_an_assessment_begins_after_its_last_sample(trained_twin):
    made = assess(trained_twin, LIMITS)
    assert [item.sequence_index for item in made] == list(range(len(made)))
    first = made[0]
    assert (first.issued_s, first.start_time_step, first.end_time_step) == (29.0, 30, 39)
    assert (first.start_s, first.end_s) == (30.0, 39.0)
    assert made[1].issued_s == 39.0


def test_reported_windows_begin_anew_in_every_segment(trained_twin):
    base = make_recording("gap")
    split = Recording("gap", base.info, base.time_s, base.values, segments=((0, 43), (43, 300)))
    scores = small_scorer(trained_twin).score(split, short_lead_steps=5)
    positions = scores.positions[reported_windows(scores, 10)]
    assert positions[:4].tolist() == [29, 39, 72, 82]


def test_a_segment_too_short_for_a_score_is_not_reported(trained_twin):
    base = make_recording("gap")
    split = Recording("gap", base.info, base.time_s, base.values, segments=((0, 29), (29, 300)))
    scores = small_scorer(trained_twin).score(split, short_lead_steps=5)
    positions = scores.positions[reported_windows(scores, 10)]
    assert positions[:2].tolist() == [58, 68]


def test_json_fits_the_published_schema_and_the_papers_keys(trained_twin):
    rows = json.loads(assessments_json(assess(trained_twin, LIMITS)))
    jsonschema.Draft202012Validator.check_schema(assessment_schema())
    papers_keys = {
        "sequence_index",
        "start_time_step",
        "end_time_step",
        "is_OOD",
        "reconstruction_error",
        "uncertainty_variance",
        "recon_exceeds_threshold",
        "uncertainty_exceeds_threshold",
        "category",
        "state_attribution",
    }
    assert papers_keys < set(rows[0])


def test_an_assessment_that_is_no_number_is_refused(trained_twin):
    recording = make_recording("nan")
    values = recording.values.copy()
    values[50:90] = np.nan
    broken = Recording("nan", recording.info, recording.time_s, values)
    with pytest.raises(OdisarError, match=r"no number|does not fit"):
        assessments_json(assess(trained_twin, LIMITS, broken))


def test_the_schema_refuses_flags_that_contradict_the_category(trained_twin):
    row = json.loads(assessments_json(assess(trained_twin, Thresholds(0.0, 0.0, 0.0))))[0]
    jsonschema.validate(row, assessment_schema())
    for change in (
        {"category": "green"},
        {"state_attribution": {}},
        {"score_exceeds_threshold": False},
        {"reconstruction_attribution": {}},
        {"recon_exceeds_threshold": False},
        {"score": 0.0},
        {"extra": 1},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(row | change, assessment_schema())
