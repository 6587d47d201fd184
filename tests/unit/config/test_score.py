"""Which windows and weights a score may be declared with."""

import copy

import pytest
from pydantic import ValidationError

from odisar.config.loader import load_config
from odisar.config.score import ScoreConfig
from small_system import SCORE


@pytest.fixture
def score():
    return copy.deepcopy(SCORE)


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("noise", "margin", -1.1),
        ("noise", "lasting_steps", 0),
        ("noise", "recent_steps", 0),
        ("noise", "recent_share", 1.0),
        ("scatter", "steps", 0),
        ("scatter", "share", -0.1),
        ("scatter", "share", 1.0),
        ("shift", "memory_steps", 0),
        ("shift", "memory_steps", 1001),
        ("shift", "margin", -1.1),
        ("release", "steps", 0),
        ("release", "share", 1.1),
        ("release", "share", -0.1),
        ("innovation", "recent_share", 1.0),
        ("consistency", "recent_share", 1.0),
        ("consistency", "share", 0.1),
    ],
)
def test_what_can_be_no_window_or_weight_is_refused_where_it_stands(score, part, key, value):
    score[part] = score[part] | {key: value}
    with pytest.raises(ValidationError, match=rf"{part}\.{key}"):
        ScoreConfig.model_validate(score)


@pytest.mark.parametrize(("part", "key"), [(part, key) for part in SCORE for key in SCORE[part]])
def test_no_window_or_weight_has_a_default(score, part, key):
    del score[part][key]
    with pytest.raises(ValidationError, match=rf"{part}\.{key}"):
        ScoreConfig.model_validate(score)


def test_that_no_shift_is_sought_is_said_by_null_and_not_by_silence(score):
    assert ScoreConfig.model_validate(score | {"shift": None}).shift is None
    del score["shift"]
    with pytest.raises(ValidationError, match="shift"):
        ScoreConfig.model_validate(score)


@pytest.mark.parametrize(
    ("part", "key"), [("noise", "margin"), ("scatter", "share"), ("release", "share")]
)
def test_no_margin_no_scatter_and_no_release_are_declared_by_zero(score, part, key):
    score[part][key] = 0.0
    assert getattr(getattr(ScoreConfig.model_validate(score), part), key) == 0


@pytest.mark.parametrize(
    ("part", "changes", "longest"),
    [
        ("innovation", {"mean_steps": 50}, 50),
        ("innovation", {"size_steps": 50}, 50),
        ("innovation", {"recent_steps": 50}, 50),
        ("consistency", {"mean_steps": 50}, 50),
        ("consistency", {"size_steps": 50}, 50),
        ("consistency", {"recent_steps": 50}, 50),
        ("scatter", {"steps": 50}, 50),
        ("scatter", {"steps": 50, "share": 0.0}, 10),
        # Of two innovations the first can't be judged.
        ("noise", {"lasting_steps": 50}, 51),
        ("shift", {"memory_steps": 50}, 10),
        ("release", {"steps": 50}, 10),
    ],
)
def test_the_longest_window_that_counts_says_when_the_first_score_is_known(
    score, part, changes, longest
):
    score[part] = score[part] | changes
    assert ScoreConfig.model_validate(score).longest_steps == longest


def test_recent_noise_is_no_older_than_lasting_noise(score):
    score["noise"] |= {"lasting_steps": 4, "recent_steps": 5}
    with pytest.raises(ValidationError, match=r"recent_steps=5 must not be above lasting_steps=4"):
        ScoreConfig.model_validate(score)
    score["noise"]["recent_steps"] = 4
    assert ScoreConfig.model_validate(score).noise.recent_steps == 4


def test_every_shipped_case_listens_to_its_sensors(request):
    cases = load_config(request.config.rootpath).cases
    assert len(cases) == 4
    for case in cases.values():
        assert case.score.noise.lasting_steps > case.score.noise.recent_steps
        assert case.score.scatter.steps > case.score.innovation.size_steps
