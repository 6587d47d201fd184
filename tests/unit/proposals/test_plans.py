"""Windows, splits and faults fit what was recorded."""

import pytest

from odisar.proposals.plans import (
    Extent,
    fault_sizes,
    make_plan,
    plan_training,
    seconds,
)


def extent(*segments, rate_hz=10.0, labels=False, splits=False, clean=None):
    clean = len(segments) if clean is None else clean
    return Extent(tuple(segments), rate_hz, clean, labels, splits)


@pytest.mark.parametrize("patch_steps", [1, 3, 5, 8])
@pytest.mark.parametrize("samples", [100, 700, 5000, 60_000])
@pytest.mark.parametrize("files", [1, 3, 30])
def test_every_plan_keeps_to_patches_and_fits_its_blocks_or_recordings(patch_steps, samples, files):
    recorded = extent(*[(samples,)] * files)
    plan = make_plan(recorded, patch_steps)
    assert plan.context % patch_steps == plan.horizon % patch_steps == 0
    room = plan.block or samples
    assert plan.window <= room or plan.doubt
    assert plan.fault_start + plan.fault_duration <= room or plan.doubt
    assert plan.fault_start >= plan.context or plan.doubt
    if plan.folds and not plan.doubt:
        assert recorded.blocks(plan.block, plan.context) >= plan.folds


def test_many_recordings_are_drawn_and_few_are_cut():
    assert make_plan(extent(*[(2000,)] * 12), 5).kind == "fractions"
    assert make_plan(extent(*[(2000,)] * 6), 5).kind == "cross-fit"
    assert make_plan(extent(*[(2000,)] * 12, clean=4), 5).kind == "cross-fit"
    assert make_plan(extent((2000,), splits=True), 5).kind == "metadata"


def test_much_data_gets_the_published_window():
    plan = make_plan(extent(*[(1200,)] * 100), 5)
    assert (plan.context, plan.horizon) == (60, 60)


def test_one_recording_that_was_broken_off_does_not_shorten_all_windows():
    assert make_plan(extent(*[(2000,)] * 20, (15,)), 5).context == 60


def test_too_little_is_said_with_what_would_do():
    plan = make_plan(extent((100,), rate_hz=10.0), 5)
    assert "too little was recorded" in plan.doubt


def test_no_more_copies_are_made_than_can_be_scored():
    small, large = extent(*[(600,)] * 12), extent(*[(40_000,)] * 12)
    assert fault_sizes(small, make_plan(small, 5), 6) == ((0.5, 1.0, 2.0), 4)
    assert fault_sizes(large, make_plan(large, 5), 6)[0] == (1.0,)


def test_training_grows_with_the_recordings():
    small, large = extent(*[(600,)] * 3), extent(*[(40_000,)] * 12)
    little = plan_training(small, make_plan(small, 5))
    much = plan_training(large, make_plan(large, 5))
    assert little.steps_per_epoch < much.steps_per_epoch == 500
    assert little.epochs < much.epochs


@pytest.mark.parametrize(
    ("steps", "rate_hz", "value"), [(299, 4, 74.0), (10, 4, 2.5), (3, 20, 0.15), (1, 100, 0.01)]
)
def test_seconds_are_easy_to_read_and_never_longer(steps, rate_hz, value):
    assert seconds(steps, rate_hz) == pytest.approx(value)
    assert seconds(steps, rate_hz) <= steps / rate_hz
