"""One wrong sample shows in two innovations; what the machine does shows in one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from odisar.capability.innovations import fit_precision
from odisar.capability.outliers import OutlierFilter
from odisar.capability.responses import StepResponse, blamed_names
from odisar.recordings.schema import Recording
from odisar.seeding import generator
from small_innovations import runs_of
from small_reference import changed, make_drive, turned
from small_system import CHANNELS, SPEC, make_recording

SAMPLES = 80
RECORDING = make_recording("any", SAMPLES)
POSITIONS = np.arange(SAMPLES)
#: What the closed form carries on of two states, and how much the machine leaves in each.
CARRIED = np.array([[0.9, 0.1], [-0.3, 0.8]])
ROOT = np.array([[1.0, 0.0], [0.6, 0.4]])
PRECISION = np.linalg.inv(ROOT @ ROOT.T)


def known_filter(unit: float = 1.0) -> OutlierFilter:
    """Return the filter of a command and two states that move as CARRIED says."""
    scaler = SimpleNamespace(mean=np.zeros(3), std=np.array([2.0, 0.5, 4.0 * unit]))
    twin = SimpleNamespace(scaler=scaler, spec=SPEC, channel_names=CHANNELS)
    linear = np.stack([np.eye(2), np.eye(2) - CARRIED])
    return OutlierFilter(twin, StepResponse(linear, np.zeros((2, 3, 3)), np.zeros((2, 3)), (1, 2)))


def usual(samples: int = SAMPLES) -> np.ndarray:
    """Return (time, state) innovations of the covariance ROOT ROOT'; the first is unknown."""
    innovations = generator(6, "usual").normal(size=(samples, 2)) @ ROOT.T
    innovations[0] = np.nan
    return innovations


def squares(innovations: np.ndarray, unit: float = 1.0) -> np.ndarray:
    samples = np.zeros((len(innovations), 3))
    positions = np.arange(len(innovations)) % SAMPLES
    return known_filter(unit).squares(RECORDING, positions, innovations, samples, PRECISION)


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_the_unit_of_a_channel_does_not_matter(unit):
    np.testing.assert_allclose(squares(usual(), unit), squares(usual()), rtol=1e-9)


@pytest.mark.parametrize("state", [0, 1])
@pytest.mark.parametrize("at", [2, 40, SAMPLES - 2])
def test_a_wrong_sample_stands_out_at_the_sample_after_it_and_in_its_own_state(at, state):
    wrong = 8 * np.eye(2)[state]
    innovations = usual()
    innovations[at] += wrong
    innovations[at + 1] -= CARRIED @ wrong
    found = squares(innovations)
    assert np.unravel_index(np.nanargmax(found), found.shape) == (at + 1, state)
    assert found[at + 1, state] > 50


@pytest.mark.parametrize("state", [0, 1])
def test_what_the_machine_does_itself_is_much_smaller_than_a_wrong_sample_of_that_size(state):
    size = 20 * np.eye(2)[state]
    step = usual()
    step[40] += size
    wrong = step.copy()
    wrong[41] -= CARRIED @ size
    assert np.nanmax(squares(step)) < 0.6 * np.nanmax(squares(wrong))
    # Right after it, where a wrong sample is told, the difference is larger still.
    assert squares(step)[41].max() < 0.5 * squares(wrong)[41].max()


def test_it_is_told_by_the_opposite_sign_of_the_second_innovation():
    opposite, same = usual(), usual()
    first = np.array([5.0, 0.0])
    second = CARRIED @ first
    opposite[40:42], same[40:42] = (first, -second), (first, second)
    before, after = first @ PRECISION @ first, second @ PRECISION @ second
    assert squares(opposite)[41, 0] == pytest.approx(before + after)
    assert squares(same)[41, 0] == pytest.approx((before - after) ** 2 / (before + after))


def test_squares_average_one_where_all_is_well():
    found = squares(usual(20_000))
    np.testing.assert_allclose(np.nanmean(found, axis=0), 1.0, atol=0.05)
    assert np.nanmean(found > 3.84) == pytest.approx(0.05, abs=0.01)


def test_nothing_is_said_until_two_innovations_are_known():
    innovations = usual()
    innovations[30] = np.nan
    unknown = np.isnan(squares(innovations))
    assert np.flatnonzero(unknown.all(axis=1)).tolist() == [0, 1, 30, 31]
    assert np.array_equal(unknown.any(axis=1), unknown.all(axis=1))
    for count in (0, 1):
        assert np.isnan(squares(innovations[:count])).all()


def test_how_samples_are_chunked_does_not_matter(trained_twin, monkeypatch):
    (run,) = runs_of(trained_twin, [make_recording("chunked", 120)])
    precision = fit_precision(run.closed_form)
    whole = run.outliers(precision)
    for size in (1, 7, 99):
        monkeypatch.setattr("odisar.capability.outliers._CHUNK", size)
        np.testing.assert_allclose(run.outliers(precision), whole, rtol=1e-9)


@pytest.mark.parametrize("twin", ["trained_twin", "drive_twin"])
def test_a_square_knows_nothing_of_what_comes_later(request, twin):
    twin = request.getfixturevalue(twin)
    base = make_drive("later", 120) if twin.spec.pose else make_recording("later", 120)
    values = base.values.copy()
    values[80:] += generator(6, "other").normal(size=values[80:].shape)
    (run,), (other,) = runs_of(twin, [base]), runs_of(twin, [changed(base, values)])
    precision = fit_precision(run.closed_form)
    upto = 80 - int(twin.spec.issue_positions((0, 120), 1)[0])
    before, after = run.outliers(precision), other.outliers(precision)
    np.testing.assert_array_equal(before[:upto], after[:upto])
    assert (before[upto] != after[upto]).all()


def taken_away(innovations: np.ndarray, signature: np.ndarray, precision: np.ndarray) -> float:
    """Return how far the best size of a signature (time, feature) brings squared distances down."""
    root = np.linalg.cholesky(precision)
    seen, shape = (innovations @ root).ravel(), (signature @ root).ravel()
    size = np.linalg.lstsq(shape[:, None], seen, rcond=None)[0][0]
    return float(seen @ seen - np.sum((seen - size * shape) ** 2))


def closed_form_innovations(twin, recording: Recording) -> np.ndarray:
    (run,) = runs_of(twin, [recording])
    return run.closed_form


def straight_drive() -> Recording:
    """Return a drive that never turns and whose stamps don't jitter: its axes stay as they are."""
    drive = make_drive("wrong", SAMPLES)
    values = drive.values.copy()
    values[:, 2:4] = np.sin(0.35), np.cos(0.35)
    return replace(drive, values=values, time_s=0.1 * np.arange(float(SAMPLES)))


@pytest.mark.parametrize("twin", ["trained_twin", "drive_twin"])
def test_squares_are_what_a_sample_made_wrong_in_the_recording_itself_explains(request, twin):
    """The last two innovations with and without it say what it leaves: no algebra has a part."""
    twin = request.getfixturevalue(twin)
    base = straight_drive() if twin.spec.pose else RECORDING
    (run,) = runs_of(twin, [base])
    precision, first = fit_precision(run.closed_form), SAMPLES - len(run.closed_form)
    found, small = run.outliers(precision), 1e-3
    # A heading would turn the axes that rates are along as well.
    names = [name for name in blamed_names(twin) if name in twin.channel_names]
    assert len(names) >= 2
    for at in (5, 23, 40):
        for name in names:
            wrong = np.zeros_like(base.values)
            wrong[first + at - 1, twin.channel_names.index(name)] = small
            more, less = (
                closed_form_innovations(twin, changed(base, base.values + sign * wrong))
                for sign in (1, -1)
            )
            shown = (more - less)[at - 1 : at + 1] / (2 * small)
            wanted = taken_away(run.closed_form[at - 1 : at + 1], shown, precision)
            square = found[at, blamed_names(twin).index(name)]
            assert square == pytest.approx(wanted, rel=0.02, abs=0.002)


def test_the_axes_of_a_wrong_position_are_those_of_the_heading_it_was_taken_at(drive_twin):
    drive = make_drive("heading", 100)
    (run,) = runs_of(drive_twin, [drive])
    positions = drive_twin.spec.issue_positions((0, 100), 1)
    values = drive.values.copy()
    half = np.pi / 4 + np.arctan2(*values[positions[40], 2:4])
    values[positions[40], 2:4] = np.sin(half), np.cos(half)
    found, other = (
        OutlierFilter.of(drive_twin).squares(
            one, positions, run.closed_form, run.samples, fit_precision(run.closed_form)
        )
        for one in (drive, changed(drive, values))
    )
    moved = ~np.isclose(found, other, equal_nan=True)
    assert np.argwhere(moved).tolist() == [[41, 0], [41, 1]]


@pytest.mark.parametrize(("channel", "name"), [(0, "position_x"), (1, "position_y")])
@pytest.mark.parametrize("angle", [0.0, 1.2, 2.5])
def test_a_wrong_position_is_seen_as_that_axis_of_the_map_whatever_the_heading(
    drive_twin, angle, channel, name
):
    runs = runs_of(drive_twin, [make_drive(f"usual-{i}") for i in range(4)])
    precision = fit_precision(np.concatenate([run.closed_form for run in runs]))
    drive = turned(make_drive("faulty"), angle)
    for at in (90, 121, 150):
        values = drive.values.copy()
        values[at, channel] += 0.02
        (run,) = runs_of(drive_twin, [changed(drive, values)])
        place = at - int(drive_twin.spec.issue_positions((0, len(values)), 1)[0])
        found = run.outliers(precision)
        assert blamed_names(drive_twin)[found[place + 1].argmax()] == name
        assert found[place + 1].max() == np.nanmax(found[place - 20 : place + 20])
