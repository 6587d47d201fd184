import numpy as np

from odisar.baselines.window_statistics import STATISTICS, window_statistics


def statistics_of(courses: list[list[float]]) -> dict[str, np.ndarray]:
    """Return by name the statistics (feature,) of one context whose features are these courses."""
    contexts = np.array(courses, dtype=float).T[None]
    values = window_statistics(contexts)[0].reshape(len(STATISTICS), len(courses))
    return dict(zip(STATISTICS, values, strict=True))


def test_each_statistic_is_what_its_name_says():
    found = statistics_of([[0, 2, 4, 6], [1, -1, 1, -1]])
    np.testing.assert_allclose(found["mean"], [3, 0])
    np.testing.assert_allclose(found["standard deviation"], [np.sqrt(5), 1])
    np.testing.assert_allclose(
        found["standard deviation of first differences"], [0, np.sqrt(32 / 9)]
    )
    np.testing.assert_allclose(found["slope per step"], [2, -0.4])
    np.testing.assert_allclose(found["last value"], [6, -1])
    np.testing.assert_allclose(found["range"], [6, 2])


def test_the_slope_is_that_of_the_least_squares_line():
    course = np.random.default_rng(5).normal(size=30)
    slope = statistics_of([course.tolist()])["slope per step"][0]
    np.testing.assert_allclose(slope, np.polyfit(np.arange(30), course, 1)[0])


def test_a_context_of_one_step_has_neither_spread_nor_slope():
    found = statistics_of([[4.0]])
    assert [float(found[name][0]) for name in STATISTICS] == [4, 0, 0, 0, 4, 0]


def test_what_stands_still_has_no_spread_not_even_by_rounding():
    found = statistics_of([[0.1] * 61, [1 / 3] * 61])
    for name in ("standard deviation", "slope per step", "range"):
        assert found[name].tolist() == [0, 0]
    assert found["mean"].tolist() == [0.1, 1 / 3]


def test_contexts_do_not_mix():
    contexts = np.random.default_rng(6).normal(size=(5, 12, 3))
    together = window_statistics(contexts)
    assert together.shape == (5, 6 * 3)
    for row, context in zip(together, contexts, strict=True):
        np.testing.assert_allclose(row, window_statistics(context[None])[0], rtol=1e-12)
