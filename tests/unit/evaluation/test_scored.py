import numpy as np
import pytest

from odisar.errors import OdisarError

from .evaluation_cases import scored


def test_a_gap_splits_the_times_into_runs():
    item = scored([0, 1, 2, 10, 11], {"odisar": np.ones(5)})
    assert item.runs() == [(0, 3), (3, 5)]


def test_the_spacing_may_be_a_multiple_of_the_step():
    item = scored(0.2 * np.arange(50), {"odisar": np.ones(50)}, step_s=0.1)
    assert item.stride_steps == 2
    assert item.spacing_s == pytest.approx(0.2)
    assert item.runs() == [(0, 50)]


def test_support_needs_every_detector():
    item = scored([0, 1, 2], {"odisar": [1, 1, np.nan], "rmse": [np.nan, 1, 1]})
    np.testing.assert_array_equal(item.support(), [False, True, False])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scores": {"odisar": [1.0]}}, "must match"),
        ({"scores": {"oracle": [1.0, 1.0]}}, "computed from the labels"),
        ({"threshold": 0.0}, "above zero"),
        ({"operating": np.nan}, "finite operating threshold"),
        ({"time_s": [1.0, 1.0]}, "increase"),
        ({"time_s": [0.0, 7.0]}, "not a multiple"),
    ],
)
def test_what_cannot_be_judged_is_named(changes, message):
    given = {"time_s": [0.0, 1.0], "scores": {"odisar": [1.0, 1.0]}} | changes
    with pytest.raises(OdisarError, match=message):
        scored(**given)
