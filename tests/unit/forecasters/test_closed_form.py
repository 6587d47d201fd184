"""The closed form is what its formula says: it finds a known system, and nothing besides."""

import numpy as np
import pytest
import torch

from odisar.forecasters import closed_form
from odisar.forecasters.closed_form import ClosedForm, design, design_width
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.seeding import generator
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec

LAGS = 3
SPEC = WindowSpec(context_steps=5, horizon_steps=2, outputs=(1,), commands=(0,), known_ahead=())
UNSCALED = Scaler(np.zeros(2), np.ones(2), np.zeros(1), np.ones(1))
#: How x(t + 1) comes about: by name of a regressor at t, in the order of the design.
SYSTEM = {
    ("u", 2): 0.0, ("x", 2): 0.1, ("u", 1): -0.3, ("x", 1): -0.2, ("u", 0): 0.5, ("x", 0): 0.4,
    "u u": 0.15, "u x": 0.25, "x x": -0.1, "u |u|": 0.2, "x |x|": -0.3, "1": 0.05,
}  # fmt: skip


def make_system(weights=SYSTEM, samples=400, noise=0.0, name="system") -> Recording:
    """Return u (white) and x, driven by the weighted regressors and by noise."""
    random = generator(3, name)
    u, x = random.uniform(-1, 1, samples), np.zeros(samples)
    disturbance = random.normal(scale=noise, size=samples) if noise else np.zeros(samples)
    for t in range(2, samples - 1):
        now = {("u", back): u[t - back] for back in range(LAGS)}
        now |= {("x", back): x[t - back] for back in range(LAGS)}
        now |= {"u u": u[t] ** 2, "u x": u[t] * x[t], "x x": x[t] ** 2}
        now |= {"u |u|": u[t] * abs(u[t]), "x |x|": x[t] * abs(x[t]), "1": 1.0}
        x[t + 1] = sum(weight * now[name] for name, weight in weights.items()) + disturbance[t]
    return of_values(np.column_stack([u, x]), name)


def of_values(values: np.ndarray, name="system") -> Recording:
    return Recording(name, RecordingInfo("system"), np.arange(float(len(values))), values)


def windows_of(*recordings: Recording) -> WindowSet:
    return WindowSet(list(recordings), UNSCALED, SPEC)


def fitted(windows: WindowSet, target_of=None) -> ClosedForm:
    """Return a closed form of the next x, or of another (window, target)."""
    target_of = target_of or (lambda batch: batch.next_sample[:, 1:])
    closed = ClosedForm(2, LAGS, target_of(windows.gather(torch.arange(1))).shape[1])
    closed.fit(windows, target_of)
    return closed


def everything(windows: WindowSet):
    return windows.gather(torch.arange(len(windows)))


def test_a_known_system_is_found_weight_by_weight():
    closed = fitted(windows_of(make_system()))
    assert closed.weights.shape == (design_width(2, LAGS), 1) == (len(SYSTEM), 1)
    np.testing.assert_allclose(closed.weights[:, 0], list(SYSTEM.values()), atol=2e-3)


@pytest.mark.parametrize("term", ["u u", "u x", "x x", "u |u|", "x |x|"])
def test_products_and_signed_squares_are_forecast_where_lags_alone_fail(term):
    weights = {("x", 0): 0.5, ("u", 0): 0.5, "1": 0.3, term: -0.4}
    windows = windows_of(make_system(weights))
    batch = everything(windows)
    lags = np.column_stack([batch.context[:, -LAGS:].flatten(1), np.ones(len(windows))])
    truth = batch.next_sample[:, 1].numpy()
    left = truth - lags @ np.linalg.lstsq(lags, truth)[0]
    assert fitted(windows).spread.item() < 0.1 * np.sqrt(np.mean(left**2))


def test_the_spread_is_the_rms_of_what_is_left_on_the_training_windows():
    windows = windows_of(make_system(noise=0.1), make_system(noise=0.1, name="other"))
    closed, batch = fitted(windows), everything(windows)
    left = batch.next_sample[:, 1:] - closed(batch.context)
    torch.testing.assert_close(closed.spread, left.square().mean(dim=0).sqrt(), rtol=1e-4, atol=0)
    assert closed.spread.item() == pytest.approx(0.1, rel=0.1)


def test_several_targets_are_fitted_as_if_alone():
    windows = windows_of(make_system(noise=0.1))
    together = fitted(windows, lambda batch: batch.truth.flatten(1))
    for step in range(SPEC.horizon_steps):
        alone = fitted(windows, lambda batch, step=step: batch.truth[:, step])
        torch.testing.assert_close(together.weights[:, step], alone.weights[:, 0])
        torch.testing.assert_close(together.spread[step], alone.spread[0])
    assert together.spread[1] > together.spread[0]


def test_what_only_the_future_tells_is_not_learned():
    """x(t + 1) is u(t + 1), which is white: from samples up to t there is nothing to learn."""
    u = generator(3, "white").normal(size=3000)
    closed = fitted(windows_of(of_values(np.column_stack([u, u]))))
    assert closed.spread.item() == pytest.approx(1.0, rel=0.05)
    assert closed.weights.abs().max() < 0.1


def test_a_forecast_looks_back_so_many_samples_and_no_further():
    closed = fitted(windows_of(make_system()))
    context = torch.randn(4, 5, 2, generator=torch.Generator().manual_seed(0))
    changed = context.clone()
    changed[:, :-LAGS] += 9.0
    assert torch.equal(closed(changed), closed(context))
    for back in range(1, LAGS + 1):
        changed = context.clone()
        changed[:, -back] += 1.0
        assert not torch.allclose(closed(changed), closed(context), atol=1e-3)


def test_the_design_says_the_last_samples_their_products_signed_squares_and_one():
    context = torch.tensor([[[9.0, 9.0], [1.0, 2.0], [-3.0, 4.0]]])
    wanted = [1, 2, -3, 4, 9, -12, 16, -9, 16, 1]
    assert design(context, 2).tolist() == [wanted]
    assert design_width(2, 2) == len(wanted)


def test_fitting_twice_gives_the_same_bytes():
    windows = windows_of(make_system(noise=0.1))
    first, again = fitted(windows), fitted(windows)
    assert first.weights.numpy().tobytes() == again.weights.numpy().tobytes()
    assert first.spread.numpy().tobytes() == again.spread.numpy().tobytes()


def test_how_many_windows_are_summed_at_a_time_does_not_matter(monkeypatch):
    windows = windows_of(make_system(noise=0.1))
    whole = fitted(windows)
    monkeypatch.setattr(closed_form, "_CHUNK", 7)
    torch.testing.assert_close(fitted(windows).weights, whole.weights)


def test_a_target_that_never_varies_is_forecast_as_it_is_and_has_a_spread_above_zero():
    u = generator(3, "white").normal(size=300)
    windows = windows_of(of_values(np.column_stack([u, np.full(300, 2.5)])))
    closed, batch = fitted(windows), everything(windows)
    torch.testing.assert_close(closed(batch.context), batch.next_sample[:, 1:], atol=1e-4, rtol=0)
    assert closed.spread.item() > 0
    assert closed.spread.item() < 1e-3


def test_no_optimiser_touches_it_and_it_travels_with_the_weights():
    closed = fitted(windows_of(make_system()))
    assert list(closed.parameters()) == []
    other = ClosedForm(2, LAGS, 1)
    other.load_state_dict(closed.state_dict())
    context = torch.randn(4, 5, 2, generator=torch.Generator().manual_seed(0))
    assert torch.equal(other(context), closed(context))
