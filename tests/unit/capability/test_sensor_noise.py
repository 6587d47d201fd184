"""How noisy the noisiest state is, on a scale of what held-out recordings are."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.innovations import LogScale
from odisar.capability.outliers import NoiseSteps, SensorNoise
from odisar.errors import OdisarError
from odisar.seeding import generator

STEPS = NoiseSteps(lasting=8, recent=3, recent_share=0.4, margin=0.25)


def squares(stream: str, samples: int = 2000, states: int = 3) -> np.ndarray:
    """Return (time, state) squares of a unit normal; none is known of the first two samples."""
    found = generator(6, "squares", stream).normal(size=(samples, states)) ** 2
    found[:2] = np.nan
    return found


@pytest.fixture(scope="module")
def noise() -> SensorNoise:
    return SensorNoise.fit([squares("a"), squares("b", 700)], STEPS)


@pytest.mark.parametrize("margin", [-0.25, 0.0, 0.25])
def test_what_is_usual_is_at_zero_and_what_is_rare_at_one_less_the_margin(margin):
    run = squares("a")
    for window, share in ((1, 0.0), (1, 0.5)):
        steps = NoiseSteps(lasting=window, recent=1, recent_share=share, margin=margin)
        found = SensorNoise.fit([run], steps).score(run)
        known = found[np.isfinite(found)]
        wanted = [-margin, 1 - margin]
        np.testing.assert_allclose(np.quantile(known, [0.5, 0.99]), wanted, atol=1e-3)


def test_both_windows_are_mixed_by_their_shares_and_each_has_its_own_scale(noise):
    run, fresh = squares("a"), squares("fresh", 60)

    def noisiest(values, steps, at):
        return np.log1p(values[at - steps + 1 : at + 1]).mean(axis=0).max()

    def on_its_scale(steps, at):
        usual = [
            np.log(noisiest(one, steps, i))
            for one in (run, squares("b", 700))
            for i in range(steps + 1, len(one))
        ]
        low, high = np.quantile(usual, [0.5, 0.99])
        return (np.log(noisiest(fresh, steps, at)) - low) / (high - low)

    found = noise.score(fresh)
    for at in (9, 30, 59):
        lasting = min(on_its_scale(8, at), on_its_scale(4, at) + 0.5)
        wanted = 0.6 * lasting + 0.4 * on_its_scale(3, at) - 0.25
        assert found[at] == pytest.approx(wanted)


def test_noise_that_only_the_older_half_of_its_window_holds_is_over(noise):
    run = squares("fresh", 60)
    run[40:] = 0.1
    run[20:40] = 30.0
    unmixed = replace(noise, steps=replace(STEPS, recent_share=0.0, margin=0.0))
    means = np.array([np.log1p(run[i - 7 : i + 1]).mean() for i in range(43, 45)])
    # The window still holds noise where its newer half no longer does.
    assert noise.lasting.of(means).min() > 1
    assert unmixed.score(run)[43:45].max() < 0
    assert unmixed.score(run)[39] > 2


@pytest.mark.parametrize("state", [0, 1, 2])
def test_the_noisiest_state_counts_and_no_other_dilutes_it(noise, state):
    run = squares("fresh", 200)
    run[100:, state] = 30.0
    others = [i for i in range(3) if i != state]
    assert np.nanmax(run[:, others]) < 30
    calm = run.copy()
    calm[100:, others] = 0.0
    after = slice(108, 200)
    np.testing.assert_array_equal(noise.score(run)[after], noise.score(calm)[after])
    assert noise.score(run)[after].min() > 2
    assert np.nanmedian(noise.score(squares("fresh", 200))) < 0


def test_a_margin_only_takes_away(noise):
    without = replace(noise, steps=replace(STEPS, margin=0.0))
    fresh = squares("fresh", 60)
    np.testing.assert_allclose(noise.score(fresh), without.score(fresh) - 0.25)


@pytest.mark.parametrize(("lasting", "recent"), [(8, 3), (3, 8), (1, 1)])
def test_the_first_score_is_known_when_it_is_said_to_be(lasting, recent):
    steps = replace(STEPS, lasting=lasting, recent=recent)
    fitted = SensorNoise.fit([squares("a")], steps)
    known = np.isfinite(fitted.score(squares("fresh", 60)))
    assert fitted.known_after_steps == max(lasting, recent) + 1
    assert not known[: fitted.known_after_steps].any()
    assert known[fitted.known_after_steps :].all()


def test_no_window_crosses_from_one_run_into_the_next():
    whole = squares("a", 400)
    apart = SensorNoise.fit([whole[:200], whole[200:]], STEPS)
    ends = np.log1p(whole)
    means = [
        ends[at - 7 : at + 1].mean(axis=0).max() for at in range(9, 400) if not 200 <= at < 207
    ]
    assert apart.lasting == LogScale.fit(np.array(means))


def test_recordings_that_are_too_short_for_it_are_refused():
    with pytest.raises(OdisarError, match="0 samples of validation recordings lie behind"):
        SensorNoise.fit([squares("a", 9)] * 3, STEPS)


@pytest.mark.parametrize(("known", "refused"), [(19, True), (20, False)])
def test_what_is_usual_is_not_learnt_from_a_handful_of_samples(known, refused):
    statistic = np.r_[np.full(30, np.nan), np.linspace(1.0, 2.0, known)]
    if refused:
        with pytest.raises(
            OdisarError, match=r"19 samples .* at least 20 must.* longer validation"
        ):
            LogScale.fit(statistic)
    else:
        assert LogScale.fit(statistic).usual == pytest.approx(np.log(1.5), rel=0.02)
