import numpy as np
import torch

from odisar.recordings.schema import Recording
from odisar.windows.nearness import nearness_table
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording


def counted(samples: int, first: int, segments: tuple[tuple[int, int], ...] = ()) -> Recording:
    base = make_recording("counted", samples)
    values = np.arange(first, first + samples, dtype=float)[:, None].repeat(3, axis=1)
    return Recording("counted", base.info, base.time_s, values, segments=segments)


IDENTITY = Scaler(np.zeros(3), np.ones(3), np.zeros(2), np.ones(2))


def test_a_batch_holds_context_and_truth_around_its_issue_position():
    windows = WindowSet([counted(40, 0)], IDENTITY, SPEC)
    batch = windows.gather(torch.tensor([0, 3]))
    assert batch.context[1, :, 0].tolist() == list(range(3, 23))
    assert batch.truth[1, :, 0].tolist() == list(range(23, 33))
    assert batch.truth.shape == (2, 10, 2)
    assert batch.known_future.shape == (2, 10, 0)


def test_no_window_crosses_a_recording_or_a_gap():
    recordings = [counted(70, 0, ((0, 33), (33, 70))), counted(40, 1000)]
    windows = WindowSet(recordings, IDENTITY, SPEC)
    assert len(windows) == (33 - 29) + (37 - 29) + (40 - 29)
    batch = windows.gather(torch.arange(len(windows)))
    steps = torch.cat([batch.context[..., 1], batch.truth[..., 0]], dim=1)
    assert torch.all(steps.diff(dim=1) == 1)
    spans = {(int(row[0]) >= 33, int(row[-1]) >= 33) for row in steps if row[0] < 1000}
    assert spans == {(False, False), (True, True)}


def test_memory_grows_with_the_samples_and_not_with_windows_times_steps():
    windows = WindowSet([counted(5000, 0)], IDENTITY, SPEC)
    held = [value for value in vars(windows).values() if hasattr(value, "nbytes")]
    assert sum(value.nbytes for value in held) <= 5000 * (3 * (4 + 8) + 8)


def test_scaling_uses_the_training_recordings_alone():
    train = [make_recording("a"), make_recording("b")]
    scaler = Scaler.fit(train, SPEC)
    stacked = np.concatenate([scaler.scale(item.values) for item in train])
    np.testing.assert_allclose(stacked.mean(axis=0), 0, atol=1e-5)
    np.testing.assert_allclose(stacked.std(axis=0), 1, atol=1e-5)


def test_scaling_survives_a_channel_that_never_moves():
    scaler = Scaler.fit([counted(40, 0)], SPEC)
    still = Scaler.fit(
        [Recording("still", make_recording("x").info, np.arange(9.0), np.ones((9, 3)))], SPEC
    )
    assert np.all(np.isfinite(scaler.scale(np.zeros((4, 3)))))
    assert np.all(still.scale(np.ones((4, 3))) == 0)


def test_nearness_finds_a_copy():
    train = [make_recording("a"), make_recording("b")]
    splits = {"train": train, "validation": [make_recording("c")], "calibration": [], "test": train}
    table = nearness_table("m", splits, Scaler.fit(train, SPEC), SPEC).set_index("split")
    assert table.loc["test", "smallest"] < 1e-6
    assert table.loc["validation", "smallest"] > 0.01
