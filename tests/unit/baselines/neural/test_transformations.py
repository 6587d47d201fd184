import numpy as np
import pytest
import torch

from odisar.baselines.neural.transformations import (
    TRANSFORMATIONS,
    high_pass,
    identity,
    low_pass,
    transformed,
)

WINDOWS = torch.randn((5, 20, 3), generator=torch.Generator().manual_seed(1))


def test_low_and_high_pass_share_a_window_between_them():
    together = low_pass(WINDOWS) + high_pass(WINDOWS)
    expected = WINDOWS + WINDOWS.mean(dim=1, keepdim=True)
    np.testing.assert_allclose(together, expected, atol=1e-6)


def test_the_low_pass_is_a_moving_average_that_shortens_at_the_ends():
    smooth = low_pass(WINDOWS)
    np.testing.assert_allclose(smooth[:, 7], WINDOWS[:, 6:9].mean(dim=1), atol=1e-6)
    np.testing.assert_allclose(smooth[:, 0], WINDOWS[:, :2].mean(dim=1), atol=1e-6)


def test_nothing_is_done_to_what_stands_still_but_by_nobody():
    still = torch.full((2, 20, 3), 4.0)
    np.testing.assert_allclose(transformed(still), still.expand(len(TRANSFORMATIONS), 2, 20, 3))


@pytest.mark.parametrize("transformation", TRANSFORMATIONS)
def test_a_window_is_transformed_by_itself(transformation):
    others = WINDOWS.clone()
    others[1:] += 7
    assert torch.equal(transformation(others)[0], transformation(WINDOWS)[0])


def test_all_forms_of_a_window_differ_and_the_first_is_its_own():
    forms = transformed(WINDOWS)
    assert torch.equal(forms[0], identity(WINDOWS))
    assert torch.equal(forms[0], WINDOWS)
    for first in range(len(forms)):
        for second in range(first):
            assert not torch.allclose(forms[first], forms[second])
