"""Fitted scores go through JSON whole; what can't be one is refused."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from odisar.capability.combined import InnovationScores
from odisar.capability.consistency import Consistency
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.innovations import InnovationScore, InnovationSteps
from odisar.seeding import generator


def fitted(states: int = 2, share_holding: float = 0.5) -> InnovationScores:
    random = generator(5, "values")
    steps = InnovationSteps(mean=6, size=4, recent=2, recent_share=0.25)
    runs, rebuilt = [random.normal(size=(200, states))], [np.exp(random.normal(size=200))]
    # One that stands out, so that the limit counts.
    runs[0][50] *= 20
    samples = random.normal(size=(200, states + 1))
    relations = Consistency.fit(samples, range(states))
    return InnovationScores(
        InnovationScore.fit(runs, rebuilt, steps),
        InnovationScore.fit(runs, None, steps),
        InnovationScore.fit([relations.residuals(samples)], None, replace(steps, mean=8)),
        relations,
        share_holding,
    )


def fresh(stream: str) -> tuple[np.ndarray, ...]:
    """Return innovations, those of the closed form, samples and reconstruction errors."""
    random = generator(5, stream)
    innovations, samples = random.normal(size=(2, 50, 2)), random.normal(size=(50, 3))
    return *innovations, samples.astype(np.float32), np.exp(random.normal(size=50))


@pytest.fixture
def content():
    return json.loads(InnovationScoreValues.of(fitted()).model_dump_json())


def test_a_score_comes_back_from_json_and_says_the_same(content):
    scores, back = fitted(), InnovationScoreValues.model_validate(content).build()
    wanted, found = scores.of(*fresh("fresh")), back.of(*fresh("fresh"))
    assert wanted.keys() == found.keys()
    for name, values in wanted.items():
        np.testing.assert_array_equal(found[name], values)
    assert (back.twin.known_after_steps, back.known_after_steps) == (6, 8)
    assert back.closed_form.reconstruction is None


def test_values_come_back_equal(content):
    values = InnovationScoreValues.model_validate(content)
    assert InnovationScoreValues.of(values.build()) == values


def test_the_number_of_states_is_that_of_every_covariance(content):
    assert InnovationScoreValues.model_validate(content).states == {2}
    content["closed_form"]["recent"]["precision"] = [[1.0]]
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


@pytest.mark.parametrize("key", ["mean", "size", "recent", "recent_share", "reconstruction"])
def test_a_part_that_is_missing_is_named(content, key):
    del content["closed_form"][key]
    with pytest.raises(ValidationError, match=f"closed_form.{key}"):
        InnovationScoreValues.model_validate(content)


@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_the_monitors_score_is_the_weighed_geometric_mean_of_its_three_parts(share):
    scores, seen = fitted(share_holding=share), fresh("both")
    found = {name: part.astype(np.float64) for name, part in scores.of(*seen).items()}
    twin = scores.twin.score(seen[0], seen[-1])
    closed, tied = found["closed-form"], found["consistency"]
    # Before all parts are known none is weighed.
    since = scores.known_after_steps
    assert np.isnan(found["odisar"][: since - 1]).all()
    assert since == (8 if share else 6)
    whole = (twin * closed * tied**share) ** (1 / (2 + share))
    np.testing.assert_allclose(found["odisar"][since:], whole[since:], rtol=1e-5)
    wanted = (closed * tied**share) ** (1 / (1 + share))
    np.testing.assert_allclose(found["without-transformer"][since:], wanted[since:], rtol=1e-5)
    residuals = scores.relations.residuals(seen[2])
    np.testing.assert_allclose(tied, scores.consistency.score(residuals, seen[-1]), rtol=1e-5)


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
