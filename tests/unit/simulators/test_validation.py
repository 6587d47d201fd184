"""The equations against R/V Gunnerus' sea trial, with the errors that the model should have."""

import os
from pathlib import Path

import pytest

from odisar.errors import OdisarError
from odisar.simulators.vessel.validation import sea_trial_table, validation_traces

_DOWNLOADED = Path(__file__).parents[3] / "data" / "raw" / "RVG_ManeuveringTests.csv"

#: RMSE and correlation of an independent implementation of the same equations.
EXPECTED = {
    "Surge Speed": (0.254, 0.983),
    "Sway Speed": (0.199, 0.929),
    "Yaw Rate": (0.272, 0.988),
    "Roll Angle": (0.475, 0.939),
}


@pytest.fixture(scope="module")
def trial() -> Path:
    given = os.environ.get("ODISAR_GUNNERUS_CSV")
    path = Path(given) if given else _DOWNLOADED
    if given is None and not path.is_file():
        pytest.skip("set ODISAR_GUNNERUS_CSV to NTNU's RVG_ManeuveringTests.csv")
    return path


@pytest.fixture(scope="module")
def table(trial):
    return sea_trial_table(trial).set_index("state")


@pytest.mark.parametrize("state", list(EXPECTED))
def test_the_model_follows_the_sea_trial(table, state):
    rmse, correlation = EXPECTED[state]
    assert table.loc[state, "rmse"] == pytest.approx(rmse, abs=0.0006)
    assert table.loc[state, "correlation"] == pytest.approx(correlation, abs=0.0006)


def test_traces_hold_every_sample_of_every_state(trial):
    traces = validation_traces(trial)
    assert list(traces.columns) == ["time_s", "state", "unit", "measured", "simulated"]
    assert traces.groupby("state").size().tolist() == [17701] * 4
    assert not traces.isna().any().any()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(OdisarError, match=r"trial\.csv is not a file"):
        sea_trial_table(tmp_path / "trial.csv")


def test_a_missing_column_is_named(tmp_path):
    path = tmp_path / "trial.csv"
    path.write_text("tvec,phi\n0.0,0.1\n")
    with pytest.raises(OdisarError, match="column 'psi' is missing"):
        sea_trial_table(path)
