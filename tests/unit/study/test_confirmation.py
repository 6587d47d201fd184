"""The second draw: the same test runs under other names, and nothing of the first one's."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from odisar.artifacts import Workspace
from odisar.config.loader import read_yaml
from odisar.recordings.schema import Recording
from odisar.simulators.robot.runs import simulate_robot
from odisar.simulators.vessel.runs import simulate_vessel
from odisar.study import confirmation
from odisar.study.confirmation import as_read, second_draw
from odisar.workspaces import merge_profile

CASES = ("vessel", "robot")


@pytest.fixture(scope="module")
def config(request):
    """Return the small profile's parameters."""
    return merge_profile(read_yaml(request.config.rootpath / "params.yaml"), "smoke")


@pytest.fixture(scope="module")
def draws(config) -> dict[str, tuple[list[Recording], list[Recording]]]:
    """Return the whole first draw of each case, and the second of its test recordings."""
    simulators = config.simulators
    first = {
        "vessel": list(simulate_vessel(simulators.vessel, simulators.seed)),
        "robot": list(
            simulate_robot(simulators.robot, simulators.seed, config.cases["robot"].channel_names)
        ),
    }
    return {name: (first[name], list(second_draw(config, config.cases[name]))) for name in CASES}


def kinds(recordings) -> Counter:
    infos = [item.info for item in recordings]
    return Counter((i.split, i.maneuver, i.disturbance, i.components, i.strength) for i in infos)


@pytest.mark.parametrize("name", CASES)
def test_the_second_draw_has_every_kind_of_test_run_as_often_and_no_other(draws, name):
    first, second = draws[name]
    assert kinds(second) == kinds(item for item in first if item.info.split == "test")


@pytest.mark.parametrize("name", CASES)
def test_no_recording_of_the_second_draw_is_one_of_the_first(draws, name):
    first, second = draws[name]
    assert not {item.name for item in first} & {item.name for item in second}
    assert not {i.info.base_seed for i in first} & {i.info.base_seed for i in second}
    for item in second:
        (origin,) = (other for other in first if f"again-{other.name}" == item.name)
        shared = min(len(item.values), len(origin.values))
        assert not np.isclose(item.values[:shared], origin.values[:shared]).all(axis=1).any()


def test_the_second_draw_is_the_same_every_time(config, draws):
    again = next(second_draw(config, config.cases["robot"]))
    np.testing.assert_array_equal(again.values, draws["robot"][1][0].values)


@pytest.mark.parametrize("name", CASES)
def test_recordings_come_as_files_would_and_lose_nothing(config, draws, tmp_path, name):
    second = draws[name][1]
    read = as_read(iter(second), name, config.cases[name], tmp_path / "build/second", tmp_path)
    by_name = {item.name: item for item in read}
    assert set(by_name) == {item.name for item in second}
    for item in second:
        np.testing.assert_allclose(by_name[item.name].values, item.values, atol=1e-6)
        assert by_name[item.name].intervals == item.intervals
        assert kinds([by_name[item.name]]) == kinds([item])


def test_a_case_that_no_simulator_makes_has_an_empty_table(config, tmp_path, monkeypatch, capsys):
    case = config.cases["gunnerus"]
    assert second_draw(config, case) is None
    monkeypatch.setattr(confirmation, "load_member", lambda *_: SimpleNamespace(case=case))
    confirmation.run(config, Workspace(tmp_path), "gunnerus")
    table = pd.read_csv(tmp_path / "reports/study/confirmation-gunnerus.csv")
    assert table.empty
    assert {"setup", "detector", "metric", "value", "on_test"} <= set(table.columns)
    assert "gunnerus: no simulator makes its recordings" in capsys.readouterr().out
