"""Scatter over many samples: a little adds up, and it counts no more than it may."""

from dataclasses import replace

import numpy as np
import pytest

from invented_scores import STEPS, invented_run, invented_scores
from odisar.capability.combined import (
    CLOSED_FORM,
    CONSISTENCY,
    ODISAR,
    SATURATED,
    WITHOUT_TRANSFORMER,
    MeanParts,
    Run,
    Scatter,
)
from odisar.capability.innovations import InnovationSize

LONG = replace(STEPS, scatter=40, scatter_share=0.3)


@pytest.fixture(scope="module")
def parts() -> MeanParts:
    return invented_scores(LONG).parts


@pytest.fixture(scope="module")
def scatter(parts) -> Scatter:
    return parts.scatter


def louder(run: Run, factor: float) -> Run:
    """Return the run with one state scattering more, for the twin and its closed form alike."""
    factors = np.array([1.0, factor])
    return replace(
        run, innovations=run.innovations * factors, closed_form=run.closed_form * factors
    )


def test_it_is_the_size_over_its_own_window_of_each_kind_of_innovation(scatter):
    held_out = [invented_run("values"), invented_run("more", 150)]
    run = invented_run("fresh")
    for size, found, values in zip(
        (scatter.twin, scatter.closed_form),
        scatter.of(run),
        ("innovations", "closed_form"),
        strict=True,
    ):
        wanted = InnovationSize.fit([getattr(one, values) for one in held_out], 40)
        np.testing.assert_array_equal(size.precision, wanted.precision)
        assert (size.steps, size.scale) == (40, wanted.scale)
        logs = wanted.scale.of(wanted.statistic(getattr(run, values)))
        np.testing.assert_allclose(found, np.minimum(logs, 1.0))
    assert scatter.share == 0.3


def test_it_has_its_share_of_every_mean_with_innovations_whatever_else_is_in_it(parts, scatter):
    run = invented_run("fresh")
    found, without = parts.of(run), replace(parts, scatter=None).of(run)
    twin, closed = scatter.of(run)
    shares = {ODISAR: (twin + closed) / 2, WITHOUT_TRANSFORMER: closed, CLOSED_FORM: closed}
    for name, added in shares.items():
        wanted = 0.7 * np.log(without[name]) + 0.3 * added
        np.testing.assert_allclose(np.log(found[name]), wanted)
    np.testing.assert_array_equal(found[CONSISTENCY], without[CONSISTENCY])


def test_it_counts_no_more_than_what_is_rare_however_large_it_is(parts, scatter):
    loud = louder(invented_run("fresh"), 100.0)
    for values in scatter.of(loud):
        np.testing.assert_array_equal(values[40:], SATURATED)
    logs = np.log(parts.of(loud)[ODISAR]) - 0.7 * np.log(
        replace(parts, scatter=None).of(loud)[ODISAR]
    )
    np.testing.assert_allclose(logs[40:], 0.3)


def test_a_little_more_scatter_than_usual_adds_up_in_it(parts, scatter):
    run = invented_run("fresh", 4000)
    more = louder(run, 1.25)
    long, brief = (
        [np.nanmedian(size.scale.of(size.statistic(one.closed_form))) for one in (more, run)]
        for size in (scatter.closed_form, parts.closed_form.size)
    )
    assert long[0] - long[1] > 0.8
    assert long[0] - long[1] > 2 * (brief[0] - brief[1])


def test_the_mean_is_not_known_before_scatter_is(parts, scatter):
    found = parts.of(invented_run("fresh", 60))
    assert scatter.known_after_steps == parts.known_after_steps == 40
    for name in (ODISAR, WITHOUT_TRANSFORMER, CLOSED_FORM):
        assert np.flatnonzero(np.isfinite(found[name])).tolist() == list(range(40, 60))


def test_without_a_share_there_is_none():
    none = invented_scores(replace(LONG, scatter_share=0.0)).parts
    assert none.scatter is None
    assert none.known_after_steps == 8
