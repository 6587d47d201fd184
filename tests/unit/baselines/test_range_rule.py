import numpy as np
import pytest

from odisar.baselines.range_rule import range_rule_scores
from odisar.config.cases import RangeRule
from odisar.config.loader import load_config
from odisar.recordings.schema import Recording
from small_system import CHANNELS, make_recording

CONTEXT = 4
RULE = RangeRule(name="speed-rule", channel="Speed", min=1.0, max=5.0)
POSITIONS = np.arange(CONTEXT - 1, 60)


@pytest.fixture(scope="module")
def case(request):
    """The shipped ferry, with the small system's channels and a context of four samples."""
    ferry = load_config(request.config.rootpath).cases["vessel"]
    channels = [ferry.channels[1].model_copy(update={"name": name}) for name in CHANNELS]
    window = ferry.window.model_copy(update={"context_steps": CONTEXT})
    return ferry.model_copy(update={"channels": channels, "window": window})


def with_speed(speed: np.ndarray) -> Recording:
    base = make_recording("range", len(speed))
    values = base.values.copy()
    values[:, CHANNELS.index("Speed")] = speed
    return Recording(base.name, base.info, base.time_s, values)


def scores(case, speed: np.ndarray, positions: np.ndarray = POSITIONS) -> np.ndarray:
    return range_rule_scores(RULE, with_speed(speed), case, positions)


@pytest.mark.parametrize(("speed", "score"), [(3.0, 0.0), (1.0, 1.0), (5.0, 1.0), (7.0, 2.0)])
def test_the_score_counts_half_widths_from_the_middle(case, speed, score):
    np.testing.assert_allclose(scores(case, np.full(60, speed)), score, atol=1e-6)


def test_only_the_last_samples_of_the_context_count(case):
    speed = np.full(60, 3.0)
    speed[20] += 8.0  # a quarter of this in every mean that holds it: one half width
    held = (POSITIONS >= 20) & (POSITIONS < 20 + CONTEXT)
    np.testing.assert_allclose(scores(case, speed), held.astype(float), atol=1e-6)


def test_positions_may_be_any_and_in_any_order(case):
    speed = np.linspace(0.0, 8.0, 60)
    chosen = np.array([50, 3, 17])
    whole = scores(case, speed)
    np.testing.assert_array_equal(
        scores(case, speed, chosen), whole[np.searchsorted(POSITIONS, chosen)]
    )


def test_nothing_after_t_moves_the_score_and_one_sigma_at_t_does(case):
    speed = make_recording("range", 60).values[:, CHANNELS.index("Speed")]
    at = 30
    later, now = speed.copy(), speed.copy()
    later[at + 1 :] += 100.0
    now[at] += speed.std()
    before, place = scores(case, speed), at - (CONTEXT - 1)
    np.testing.assert_array_equal(scores(case, later)[: place + 1], before[: place + 1])
    assert abs(scores(case, now)[place] - before[place]) > 1e-3
