"""The alias moves when a version is better on the same development recordings, and else stays."""

import pytest

from odisar.config.registry import ChampionRule
from odisar.tracking.champion import Standing, decide

RULE = ChampionRule(metric="auroc", margin=0.0)
NAME = "odisar.small"


def decided(new, old, margin=0.0):
    champion = None if old is None else Standing("1", *old)
    rule = ChampionRule(metric="auroc", margin=margin)
    return decide(NAME, Standing("2", *new), champion, rule)


@pytest.mark.parametrize("auroc", [0.7, None])
def test_the_first_version_is_the_champion(auroc):
    found = decided((auroc, "none"), None)
    assert found.moves
    assert "version 2 is the first" in found.sentence


def test_a_better_version_is_the_champion_and_both_numbers_are_said():
    found = decided((0.91,), (0.9,))
    assert found.moves
    assert "version 2 reached AUROC 0.910000" in found.sentence
    assert "version 1 AUROC 0.900000" in found.sentence


@pytest.mark.parametrize(("new", "margin"), [(0.9, 0.0), (0.89, 0.0), (0.92, 0.02), (0.91, 0.05)])
def test_a_version_that_is_not_better_by_more_than_the_margin_is_not(new, margin):
    found = decided((new,), (0.9,), margin)
    assert not found.moves
    assert "version 1 stayed the champion" in found.sentence
    assert f"`odisar promote {NAME} 2`" in found.sentence


@pytest.mark.parametrize(
    ("new", "old", "why"),
    [
        ((None, "no recordings"), (0.9,), "version 2: no recordings"),
        ((0.95,), (None, "other channels"), "version 1: other channels"),
    ],
)
def test_what_cannot_be_compared_leaves_the_alias_and_says_how_to_move_it(new, old, why):
    found = decided(new, old)
    assert not found.moves
    assert why in found.sentence
    assert f"`odisar promote {NAME} 2`" in found.sentence
