"""What is done to a window before a classifier is asked what it was.

Filters alone, as in the published experiments on sensor data. On development recordings of the
vessel they ranked better than together with time reversal, shuffling and dilation, which are
confused on undisturbed windows as well.
"""

from collections.abc import Callable

import torch
import torch.nn.functional as F

#: Changes windows (window, step, feature) into others of the same shape, each by itself.
Transformation = Callable[[torch.Tensor], torch.Tensor]

# Steps of the moving average that separates slow from fast; the fewer, the harder the question.
_FILTER_STEPS = 3


def identity(windows: torch.Tensor) -> torch.Tensor:
    """Return the windows as they are."""
    return windows


def low_pass(windows: torch.Tensor) -> torch.Tensor:
    """Return the moving average, over fewer steps at both ends of a window."""
    by_step = windows.transpose(1, 2)
    smooth = F.avg_pool1d(
        by_step, _FILTER_STEPS, stride=1, padding=_FILTER_STEPS // 2, count_include_pad=False
    )
    return smooth.transpose(1, 2)


def high_pass(windows: torch.Tensor) -> torch.Tensor:
    """Return what the moving average leaves out, about the mean of the window."""
    return windows - low_pass(windows) + windows.mean(dim=1, keepdim=True)


#: In the order of the classifier's classes.
TRANSFORMATIONS: tuple[Transformation, ...] = (identity, low_pass, high_pass)


def transformed(windows: torch.Tensor) -> torch.Tensor:
    """Return (transformation, window, step, feature), every window in every form."""
    return torch.stack([transformation(windows) for transformation in TRANSFORMATIONS])
