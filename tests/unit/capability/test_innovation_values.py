"""Fitted scores go through JSON whole; what can't be one is refused."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from invented_scores import STEPS, invented_run, invented_scores
from odisar.capability.combined import RELEASED
from odisar.capability.innovation_values import InnovationScoreValues


@pytest.fixture
def content():
    return json.loads(InnovationScoreValues.of(invented_scores()).model_dump_json())


def test_a_score_comes_back_from_json_and_says_the_same(content):
    scores, back = invented_scores(), InnovationScoreValues.model_validate(content).build()
    wanted, found = scores.of(invented_run("fresh")), back.of(invented_run("fresh"))
    assert wanted.keys() == found.keys()
    for name, values in wanted.items():
        np.testing.assert_array_equal(found[name], values)
    assert (back.parts.twin.known_after_steps, back.known_after_steps) == (6, 8)
    assert back.parts.closed_form.reconstruction is None


def test_noise_scatter_and_the_scales_come_back_as_they_were(content):
    scores, back = invented_scores(), InnovationScoreValues.model_validate(content).build()
    assert back.noise == scores.noise
    assert back.noise.steps == STEPS.noise
    assert back.shift == scores.shift
    assert back.shift.steps == STEPS.shift
    assert (back.scales, back.release) == (scores.scales, scores.release)
    assert len({(scale.usual, scale.rare) for scale in back.scales.values()}) == len(RELEASED)
    assert back.parts.scatter.share == 0.15
    for part in ("twin", "closed_form"):
        wanted, found = getattr(scores.parts.scatter, part), getattr(back.parts.scatter, part)
        np.testing.assert_array_equal(found.precision, wanted.precision)
        assert (found.steps, found.scale) == (7, wanted.scale)


@pytest.mark.parametrize(
    ("key", "steps"),
    [("scatter", replace(STEPS, scatter_share=0.0)), ("shift", replace(STEPS, shift=None))],
)
def test_without_scatter_or_shift_the_mapping_says_null_and_must_say_so(key, steps):
    content = json.loads(InnovationScoreValues.of(invented_scores(steps)).model_dump_json())
    assert content[key] is None
    back = InnovationScoreValues.model_validate(content).build()
    assert (back.parts.scatter if key == "scatter" else back.shift) is None
    del content[key]
    with pytest.raises(ValidationError, match=key):
        InnovationScoreValues.model_validate(content)


def test_values_come_back_equal(content):
    values = InnovationScoreValues.model_validate(content)
    assert InnovationScoreValues.of(values.build()) == values


def test_the_number_of_states_is_that_of_every_covariance(content):
    assert InnovationScoreValues.model_validate(content).states == {2}
    for part, key in (
        *(("closed_form", name) for name in ("recent", "newer_mean", "newer_size")),
        ("scatter", "twin"),
        ("scatter", "closed_form"),
    ):
        other = copy.deepcopy(content)
        other[part][key]["precision"] = [[1.0]]
        assert InnovationScoreValues.model_validate(other).states == {1, 2}


@pytest.mark.parametrize("key", ["mean", "newer_mean"])
def test_a_limit_is_a_covariance_too(content, key):
    content["closed_form"][key]["limit"]["precision"] = [[1.0]]
    assert InnovationScoreValues.model_validate(content).states == {1, 2}


def test_without_a_reconstruction_the_mapping_says_null(content):
    assert content["closed_form"]["reconstruction"] is None
    assert set(content["twin"]["reconstruction"]) == {"usual", "rare"}


def test_the_recent_mean_has_no_limit_and_says_so(content):
    assert content["twin"]["recent"]["limit"] is None
    del content["twin"]["mean"]["limit"]
    with pytest.raises(ValidationError, match=r"twin\.mean\.limit"):
        InnovationScoreValues.model_validate(content)


@pytest.mark.parametrize(
    ("place", "value", "complaint"),
    [
        (("mean", "precision"), [[1.0, 0.0], [0.0]], "expected 2 numbers in each row"),
        (("size", "precision"), [[1.0, 0.0]], "expected 1 numbers in each row"),
        (("recent", "precision"), [[1.0, 0.0], [0.0, 1e31]], "less than or equal"),
        (("mean", "precision"), [["1", "0"], ["0", "1"]], "valid number"),
        (("mean", "scale"), {"usual": 2.0, "rare": 1.0}, "must be above usual=2.0"),
        (("mean", "scale"), {"usual": 2.0, "rare": 2.0}, "must be above usual=2.0"),
        (("reconstruction",), {"usual": 0.0, "rare": float("nan")}, "rare"),
        (("mean", "scale"), {"usual": float("-inf"), "rare": 0.0}, "usual"),
        (("mean", "limit", "distance"), 0.0, "greater than 0"),
        (("mean", "limit", "precision"), [[1.0, 0.0]], "expected 1 numbers in each row"),
        (("size", "limit"), None, "Extra inputs"),
        (("size", "steps"), 0, "greater than 0"),
        (("size", "steps"), 2.5, "valid integer"),
        (("recent_share",), 1.0, "less than 1"),
        (("recent_share",), -0.1, "greater than or equal to 0"),
        (("note",), 1, "Extra inputs"),
    ],
)
def test_what_can_be_no_score_is_refused(content, place, value, complaint):
    spoilt = copy.deepcopy(content)
    at = spoilt["twin"]
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] = value
    with pytest.raises(ValidationError, match=complaint):
        InnovationScoreValues.model_validate(spoilt)


@pytest.mark.parametrize("share", [-0.1, 1.1, None])
def test_a_share_is_between_none_and_all(content, share):
    content["share_holding"] = share
    with pytest.raises(ValidationError, match="share_holding"):
        InnovationScoreValues.model_validate(content)


@pytest.mark.parametrize(
    "key",
    ["mean", "size", "newer_mean", "newer_size", "recent", "recent_share", "reconstruction"],
)
def test_a_part_that_is_missing_is_named(content, key):
    del content["closed_form"][key]
    with pytest.raises(ValidationError, match=f"closed_form.{key}"):
        InnovationScoreValues.model_validate(content)


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("weights", [[1.0, 2.0]], "expected 2 rows"),
        ("weights", [[1.0, 2.0], [1.0]], "as many numbers in each row"),
        ("weights", [[1.0], [float("nan")]], "weights.1.0"),
        ("states", [0, -1], "states.1"),
        ("note", 1, "Extra inputs"),
    ],
)
def test_relations_that_can_be_none_are_refused(content, key, value, complaint):
    content["relations"][key] = value
    with pytest.raises(ValidationError, match=complaint):
        InnovationScoreValues.model_validate(content)


@pytest.mark.parametrize(
    ("place", "value", "complaint"),
    [
        (("noise", "steps", "lasting"), 0, "greater than 0"),
        (("noise", "steps", "recent"), 1.5, "valid integer"),
        (("noise", "steps", "recent_share"), 1.0, "less than 1"),
        (("noise", "steps", "margin"), float("nan"), "margin"),
        (("noise", "steps", "note"), 1, "Extra inputs"),
        (("noise", "lasting"), {"usual": 1.0, "rare": 1.0}, "must be above usual=1.0"),
        (("noise", "newer"), None, "noise.newer"),
        (("noise", "recent"), None, "noise.recent"),
        (("noise",), None, "noise"),
        (("scatter", "share"), 0.0, "greater than 0"),
        (("scatter", "share"), 1.0, "less than 1"),
        (("scatter", "twin", "steps"), 0, "greater than 0"),
        (("scatter", "twin", "precision"), [[1.0, 0.0]], "expected 1 numbers in each row"),
        (("scatter", "closed_form", "scale"), {"usual": 2.0, "rare": 1.0}, "above usual=2.0"),
        (("scatter", "closed_form"), None, "scatter.closed_form"),
        (("scales", "odisar"), {"usual": 1.0, "rare": 0.0}, "must be above usual=1.0"),
        (("scales", "closed-form"), {"usual": 0.0}, "scales.closed-form.rare"),
        (("scales", "other"), {"usual": 0.0, "rare": 1.0}, "expected odisar, without-transformer"),
        (("scales",), {"odisar": {"usual": 0.0, "rare": 1.0}}, "without-transformer, closed-form"),
        (("shift", "steps", "memory"), 0, "greater than or equal to 1"),
        (("shift", "steps", "memory"), 1001, "less than or equal to 1000"),
        (("shift", "steps", "margin"), -1.1, "greater than or equal to -1"),
        (("shift", "twin"), {"usual": 1.0, "rare": 1.0}, "must be above usual=1.0"),
        (("shift", "closed_form"), None, "shift.closed_form"),
        (("release", "steps"), 0, "greater than 0"),
        (("release", "share"), 1.1, "less than or equal to 1"),
        (("release", "share"), -0.1, "greater than or equal to 0"),
    ],
)
def test_noise_scatter_and_scales_that_can_be_none_are_refused(content, place, value, complaint):
    at = content
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] = value
    with pytest.raises(ValidationError, match=complaint):
        InnovationScoreValues.model_validate(content)


@pytest.mark.parametrize("key", sorted(InnovationScoreValues.model_fields))
def test_whatever_of_the_whole_is_missing_is_named(content, key):
    del content[key]
    with pytest.raises(ValidationError, match=key):
        InnovationScoreValues.model_validate(content)
