"""A version's description: what it is, one of how many, and what was measured."""

import pytest

from odisar.deployment.bundle import read_bundle
from odisar.tracking.description import describe_version, pip_requirements
from small_bundle import development_score, write_small_bundle


@pytest.fixture
def deployed(trained_twin, tmp_path):
    return read_bundle(
        write_small_bundle(tmp_path / "b", trained_twin, member="small.fold-0", members=6)
    )


def test_a_twin_of_a_cross_fitted_set_up_says_so(deployed):
    text = describe_version(deployed, "m", "1", development_score(), "decided")
    assert "twin `small.fold-0`, one of 6 of the set-up" in text
    assert "30 to 2000 rows" in text


def test_what_was_not_measured_is_not_claimed(deployed):
    text = describe_version(deployed, "m", "1", development_score(None), "decided")
    assert "Nothing: there are no disturbed development recordings." in text


def test_requirements_are_pinned_to_what_an_index_offers():
    assert all(part.count("==") == 1 and "+" not in part for part in pip_requirements())
