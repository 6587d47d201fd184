"""The monitor's score: the mean of its parts, one sensor's noise or shift, whichever is rarer."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from invented_scores import (
    HEARING,
    STEPS,
    invented_run,
    invented_scores,
    noise_of,
    shift_of,
)
from odisar.capability.combined import (
    CLOSED_FORM,
    CONSISTENCY,
    ODISAR,
    RELEASED,
    WITHOUT_TRANSFORMER,
    InnovationScores,
    MeanParts,
    Run,
)
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import LogScale
from odisar.capability.outliers import NoiseSteps, SensorNoise
from odisar.capability.release import Release
from odisar.capability.shifts import StateShift
from odisar.recordings.schema import Recording
from odisar.seeding import generator
from small_innovations import STEPS as SMALL_STEPS
from small_innovations import runs_of
from small_system import make_gusty


@pytest.fixture(scope="module")
def scores() -> InnovationScores:
    return invented_scores()


def with_outliers(run: Run, square: float) -> Run:
    """Return the run with the same square everywhere, whatever the precision."""
    return replace(run, outliers=lambda _: np.full(run.innovations.shape, square))


@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_the_mean_is_the_weighed_geometric_one_of_three_parts(scores, share):
    parts = replace(scores.parts, share_holding=share, scatter=None)
    run = invented_run("both", 50)
    found = parts.of(run)
    twin = parts.twin.score(run.innovations, run.reconstruction)
    closed = parts.closed_form.score(run.closed_form, run.reconstruction)
    residuals = parts.relations.residuals(run.samples)
    tied = parts.consistency.score(residuals, run.reconstruction)
    np.testing.assert_array_equal(found[CLOSED_FORM], closed)
    np.testing.assert_array_equal(found[CONSISTENCY], tied)
    whole = (twin * closed * tied**share) ** (1 / (2 + share)) if share else np.sqrt(twin * closed)
    np.testing.assert_allclose(found[ODISAR], whole)
    wanted = (closed * tied**share) ** (1 / (1 + share)) if share else closed
    np.testing.assert_allclose(found[WITHOUT_TRANSFORMER], wanted)
    assert parts.known_after_steps == (8 if share else 6)


@pytest.mark.parametrize("name", HEARING)
def test_the_whole_is_the_largest_of_mean_noise_and_shift_on_one_log_scale(scores, name):
    run = invented_run("fresh", 400)
    mean = scores.scales[name].of(scores.parts.of(run)[name])
    parts = np.stack([mean, noise_of(scores, run), shift_of(scores, run, name)])
    found = scores.of(run)[name]
    known = slice(scores.known_after_steps, None)
    wanted = np.exp(scores.release.of(parts.max(axis=0)[known]))
    np.testing.assert_allclose(found[known], wanted, rtol=1e-5)
    # Each of them counts at times.
    assert {0, 1, 2} == set(parts[:, known].argmax(axis=0))
    assert found.dtype == np.float32


@pytest.mark.parametrize("name", RELEASED)
def test_every_mean_on_the_log_scale_lets_go_of_something_strong_that_is_over(scores, name):
    run = with_outliers(invented_run("fresh", 300), 0.0)
    innovations, closed_form = run.innovations.copy(), run.closed_form.copy()
    for struck in (innovations, closed_form):
        struck[200:220] *= 200
    run = replace(run, innovations=innovations, closed_form=closed_form)
    scores = replace(scores, shift=None)
    mean = scores.scales[name].of(scores.parts.of(run)[name])
    found = np.log(scores.of(run)[name])
    np.testing.assert_allclose(found, scores.release.of(mean), atol=1e-5)
    assert (found[200:220] > 2).all()
    assert (found[220:230] < mean[220:230] - 0.5).any()


@pytest.mark.parametrize("name", HEARING)
def test_noise_of_one_sensor_that_is_over_is_let_go_of_as_well(scores, name):
    run = invented_run("fresh", 300)
    squares = np.zeros(run.innovations.shape)
    squares[200:220] = 1e30
    run, scores = replace(run, outliers=lambda _: squares), replace(scores, shift=None)
    mean = scores.scales[name].of(scores.parts.of(run)[name])
    found = np.log(scores.of(run)[name])
    wanted = scores.release.of(np.maximum(mean, noise_of(scores, run)))
    np.testing.assert_allclose(found, wanted, atol=1e-5)
    assert (found[220:230] < mean[220:230] - 0.5).any()


def test_noise_raises_the_whole_and_neither_the_closed_form_nor_consistency(scores):
    scores = replace(scores, shift=None)
    calm = scores.of(with_outliers(invented_run("fresh"), 0.0))
    loud = scores.of(with_outliers(invented_run("fresh"), 1e4))
    known = slice(scores.known_after_steps, None)
    for name in HEARING:
        assert (loud[name][known] > 2 * calm[name][known]).all()
    for name in (CLOSED_FORM, CONSISTENCY):
        np.testing.assert_array_equal(loud[name], calm[name])


def test_whatever_a_sensor_reads_the_whole_stays_a_number(scores):
    run = invented_run("fresh")
    extreme = replace(run, innovations=1e150 * run.innovations, closed_form=1e150 * run.closed_form)
    known = slice(scores.known_after_steps, None)
    for name in HEARING:
        assert np.isfinite(scores.of(extreme)[name][known]).all()
        assert scores.of(extreme)[name][known].min() > scores.of(run)[name][known].max()


def test_after_whatever_a_sensor_has_read_scores_stay_above_zero(scores):
    run = invented_run("fresh", 300)
    innovations, closed_form = run.innovations.copy(), run.closed_form.copy()
    for struck in (innovations, closed_form):
        struck[200:220] *= 1e150
    extreme = replace(run, innovations=innovations, closed_form=closed_form)
    found = replace(scores, release=Release(8, 1.0)).of(extreme)
    for name in RELEASED:
        assert (found[name][scores.known_after_steps :] > 0).all()


def test_the_filter_is_asked_with_the_precision_of_the_closed_forms_innovations(scores):
    asked, run = [], invented_run("fresh")

    def outliers(precision: np.ndarray) -> np.ndarray:
        asked.append(precision)
        return run.outliers(precision)

    scores.of(replace(run, outliers=outliers))
    InnovationScores.fit([replace(run, outliers=outliers)], scores.parts.relations, STEPS)
    fitted = MeanParts.fit([run], scores.parts.relations, STEPS)
    wanted = [scores.parts.closed_form.size.precision, fitted.closed_form.size.precision]
    np.testing.assert_array_equal(asked, wanted)
    assert not np.allclose(wanted[0], scores.parts.twin.size.precision)


def test_on_what_it_was_fitted_to_the_mean_is_usually_zero_and_rarely_one(scores):
    held_out = [invented_run("values"), invented_run("more", 150)]
    assert set(scores.scales) == {*HEARING, CLOSED_FORM}
    for name, scale in scores.scales.items():
        means = np.concatenate([scores.parts.of(run)[name] for run in held_out])
        assert scale == LogScale.fit(means)
        found = scale.of(means[np.isfinite(means)])
        np.testing.assert_allclose(np.quantile(found, [0.5, 0.99]), [0, 1], atol=0.02)
    noise = [run.outliers(scores.parts.closed_form.size.precision) for run in held_out]
    assert scores.noise == SensorNoise.fit(noise, STEPS.noise)
    twin, closed = (
        [run.shifts(getattr(run, name), part.size.precision, 9) for run in held_out]
        for name, part in (
            ("innovations", scores.parts.twin),
            ("closed_form", scores.parts.closed_form),
        )
    )
    assert scores.shift == StateShift.fit(twin, closed, STEPS.shift)
    assert scores.release == STEPS.release


def test_the_share_is_that_of_relations_which_hold_on_held_out_recordings(scores):
    assert scores.parts.share_holding == 0.5
    held_out = [invented_run("values"), invented_run("more", 150)]
    samples = np.concatenate([run.samples for run in held_out])
    assert scores.parts.share_holding == scores.parts.relations.share_holding(samples)


@pytest.mark.parametrize(
    ("lasting", "scatter", "known_after"), [(5, 7, 8), (12, 7, 13), (5, 11, 11)]
)
def test_the_first_score_is_known_when_every_part_is(lasting, scatter, known_after):
    noise = NoiseSteps(lasting, 2, recent_share=0.4, margin=0.3)
    steps = replace(STEPS, scatter=scatter, noise=noise)
    fitted = invented_scores(steps)
    found = fitted.of(invented_run("fresh", 40))
    assert fitted.known_after_steps == known_after
    known = np.isfinite(found[ODISAR])
    assert known[known_after:].all()
    assert not known[: known_after - 1].any()


@pytest.fixture(scope="module")
def monitor(gusty_twin) -> InnovationScores:
    """Return scores of the gusty machine that listen to noise over 20 samples."""
    runs = runs_of(gusty_twin, [make_gusty(f"held-out-{i}") for i in range(8)])
    samples = np.concatenate([run.samples for run in runs])
    relations = Consistency.fit(samples, gusty_twin.network.state_features)
    noise = NoiseSteps(lasting=20, recent=5, recent_share=0.3, margin=0.0)
    return InnovationScores.fit(runs, relations, replace(SMALL_STEPS, noise=noise))


def noisy(channel: int) -> Iterator[Recording]:
    """Yield recordings one of whose sensors scatters as much as most gusts push."""
    for number in range(6):
        base = make_gusty(f"noisy-{number}")
        values = base.values.copy()
        values[:, channel] += 0.1 * generator(3, "noise", str(number)).normal(size=len(values))
        yield replace(base, values=values)


@pytest.mark.parametrize("channel", [1, 2])
def test_the_monitor_hears_a_noisy_sensor_that_the_mean_of_its_parts_misses(
    gusty_twin, monitor, channel
):
    usual = [make_gusty(f"usual-{i}") for i in range(6)]
    faulty = runs_of(gusty_twin, noisy(channel))
    missed = [monitor.scales[ODISAR].of(monitor.parts.of(run)[ODISAR]) for run in faulty]
    heard = [np.log(monitor.of(run)[ODISAR]) for run in faulty]
    false = [np.log(monitor.of(run)[ODISAR]) for run in runs_of(gusty_twin, usual)]
    assert share_of_rare(missed) < 0.1
    assert share_of_rare(heard) > 0.6
    assert share_of_rare(false) < 0.05


def share_of_rare(logs: list[np.ndarray]) -> float:
    """Return the share of known scores that are rarer than one in a hundred."""
    known = np.concatenate(logs)
    return float(np.mean(known[np.isfinite(known)] > 1))
