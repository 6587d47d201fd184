"""What a change of one state leaves in innovations, by the closed form that forecasts."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.capability.responses import StepResponse, blamed_names, state_directions
from odisar.config.loader import load_config
from odisar.forecasters.closed_form import design
from odisar.seeding import generator
from odisar.windows.coordinates import features
from small_bundle import small_case
from small_system import CHANNELS, SPEC, make_recording


def relative_case():
    channels = [channel.model_dump() | {"role": "state"} for channel in small_case().channels]
    channels[0]["unit"] = "rad"
    pose = {"x": "Speed", "y": "Turn Rate", "heading": ["Command"], "coordinates": "relative"}
    return small_case(channels=channels, pose=pose)


def test_whoever_can_be_blamed_is_named_as_the_case_names_them(trained_twin, relative_twin):
    assert list(blamed_names(trained_twin)) == small_case().blamed_names == ["Speed", "Turn Rate"]
    names = ["Speed", "Turn Rate", "Command"]
    assert list(blamed_names(relative_twin)) == relative_case().blamed_names == names


def test_a_heading_of_two_channels_is_one_state(request):
    shipped = load_config(request.config.rootpath).cases["robot"]
    heading = " / ".join(shipped.pose.heading)
    assert len(shipped.pose.heading) == 2
    assert shipped.blamed_names[:3] == [shipped.pose.x, shipped.pose.y, heading]


def test_a_direction_is_how_a_shift_enters_the_features(relative_twin):
    """Without a turn in between, the rates of a shifted sample differ by the direction itself."""
    recording = make_recording("shifted")
    values = recording.values.copy()
    values[:, 0] = np.repeat(np.linspace(-3, 3, 10), 30)
    base = replace(recording, values=values)
    positions = np.arange(20, 300, 30)
    directions = state_directions(relative_twin, base, positions)
    assert directions.shape == (10, 3, 3)
    scale = relative_twin.scaler.scale
    for state, channel in enumerate((1, 2)):
        for at, direction in zip(positions, directions[:, state], strict=True):
            shifted = base.values.copy()
            shifted[at:, channel] += 0.5
            seen = [
                scale(features(replace(base, values=v), relative_twin.spec.pose))[at]
                for v in (shifted, base.values)
            ]
            np.testing.assert_allclose(seen[0] - seen[1], 0.5 * direction, atol=1e-4)


def test_without_a_pose_a_state_is_its_own_feature(trained_twin):
    directions = state_directions(trained_twin, make_recording("a"), np.array([30, 40]))
    wanted = np.diag(1 / trained_twin.scaler.std[1:])
    np.testing.assert_allclose(directions, [wanted, wanted])


def test_a_step_leaves_what_the_closed_form_does_not_carry_on_from_where_the_machine_is(
    trained_twin,
):
    network = trained_twin.network
    closed, random = network.next_closed_form, generator(4, "where")
    samples = random.normal(size=(30, len(CHANNELS)))
    response = StepResponse.of(trained_twin).at(samples)
    features = network.state_features
    assert response.shape == (closed.lags + 1, 30, len(features), len(features))
    now, small = 29, 1e-4
    context = torch.from_numpy(samples[None, now - SPEC.context_steps : now])
    forecast = design(context, closed.lags) @ closed.weights.double()
    for age in range(closed.lags + 1):
        for column, feature in enumerate(features):
            shifted = context.clone()
            shifted[:, SPEC.context_steps - age :, feature] += small
            moved = design(shifted, closed.lags) @ closed.weights.double() - forecast
            left = -moved[0].numpy() / small
            left[column] += 1.0
            np.testing.assert_allclose(response[age, now, :, column], left, atol=1e-3)


@pytest.mark.parametrize("twin", ["trained_twin", "relative_twin", "drive_twin"])
def test_what_is_carried_on_is_the_slope_of_the_next_forecast_in_the_newest_sample(request, twin):
    network = request.getfixturevalue(twin).network
    closed, states = network.next_closed_form, network.state_features
    count, small = len(request.getfixturevalue(twin).scaler.mean), 1e-5
    samples = generator(4, "carried").normal(size=(30, count))
    carried = StepResponse.of(request.getfixturevalue(twin)).carried(samples)
    assert carried.shape == (30, len(states), len(states))

    def forecast(change: np.ndarray) -> np.ndarray:
        context = torch.from_numpy(samples[None, : now + 1]).clone()
        context[0, -1] += torch.from_numpy(change)
        return (design(context, closed.lags) @ closed.weights.double())[0].numpy()

    for now in (closed.lags - 1, 29):
        for column, feature in enumerate(states):
            change = small * np.eye(count)[feature]
            slope = (forecast(change) - forecast(-change)) / (2 * small)
            np.testing.assert_allclose(carried[now, :, column], slope, atol=1e-6)


def test_what_is_carried_on_depends_on_where_the_machine_is(trained_twin):
    response = StepResponse.of(trained_twin)
    still, moving = response.carried(np.array([[0.0, 0.0, 0.0], [1.0, 2.0, -1.0]]))
    np.testing.assert_array_equal(still, response.linear[0] - response.linear[1])
    assert np.abs(moving - still).max() > 1e-3


def test_an_unknown_sample_is_taken_for_the_usual_one(trained_twin):
    response = StepResponse.of(trained_twin)
    unknown, usual = np.full((1, 3), np.nan), np.zeros((1, 3))
    np.testing.assert_array_equal(response.carried(unknown), response.carried(usual))
