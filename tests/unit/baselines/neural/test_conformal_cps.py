import math

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from odisar.baselines.interface import context_positions
from odisar.baselines.neural.conformal_cps import (
    ConformalTransformations,
    TransformationClassifier,
    conformal_p_values,
)
from odisar.baselines.neural.transformations import TRANSFORMATIONS
from small_reference import system_reference

from .neural_cases import BUDGET

KNOWN = np.array([[1.0, 10.0], [2.0, 20.0], [2.0, 30.0], [3.0, 40.0]])


def test_a_p_value_is_the_share_of_losses_at_least_as_high_itself_among_them():
    losses = np.array([[2.0, 5.0], [9.0, 40.0], [2.5, 41.0]])
    expected = np.array([[4, 5], [1, 2], [2, 1]]) / 5
    np.testing.assert_allclose(conformal_p_values(losses, KNOWN), expected)


@given(st.lists(st.floats(-5, 5), min_size=2, max_size=30), st.floats(0.01, 0.99))
def test_p_values_of_losses_like_the_known_ones_are_seldom_small(losses, level):
    # Each in turn is asked against the others: at most a share of `level` may fall below it.
    values = np.array(losses)
    p_values = [
        conformal_p_values(values[[i], None], np.sort(np.delete(values, i))[:, None])[0, 0]
        for i in range(len(values))
    ]
    assert np.mean(np.array(p_values) <= level) <= level + 1e-9


def test_a_window_counts_under_every_transformation():
    torch.manual_seed(2)
    network = TransformationClassifier(3).eval()
    windows = torch.randn(4, 20, 3)
    losses = network.losses(windows)
    assert losses.shape == (4, len(TRANSFORMATIONS))
    for asked, transformation in enumerate(TRANSFORMATIONS):
        chances = network(transformation(windows)).softmax(dim=1)[:, asked]
        np.testing.assert_allclose(
            losses[:, asked].detach(), -chances.log().detach(), rtol=1e-4, atol=1e-6
        )


def scores_with(**options: int) -> np.ndarray:
    reference = system_reference()
    detector = ConformalTransformations(BUDGET, **options)
    detector.fit(reference)
    recording = reference.held_out[0]
    positions = context_positions(recording, reference.spec)
    return detector.score([recording])[0][positions]


def test_the_statistic_is_fishers_sum_over_the_last_windows():
    one = scores_with(stride_steps=5, windows_counted=1)
    three = scores_with(stride_steps=5, windows_counted=3)
    one, three = one[::5], three[::5]
    np.testing.assert_allclose(three[2:], one[2:] + one[1:-1] + one[:-2], rtol=1e-9, atol=1e-9)


def test_the_first_windows_of_a_segment_stand_for_those_that_are_missing():
    one = scores_with(stride_steps=5, windows_counted=1)
    three = scores_with(stride_steps=5, windows_counted=3)
    np.testing.assert_allclose(three[0], 3 * one[0], rtol=1e-9)
    np.testing.assert_allclose(three[5], 1.5 * (one[0] + one[5]), rtol=1e-9)


def test_no_score_is_higher_than_one_of_a_window_unlike_all_held_out_ones():
    scores = scores_with(stride_steps=1, windows_counted=1)
    reference = system_reference()
    held_out = sum(
        len(recording.time_s) // reference.spec.context_steps for recording in reference.held_out
    )
    highest = 2 * len(TRANSFORMATIONS) * math.log(held_out + 1)
    assert scores.max() <= highest + 1e-9
