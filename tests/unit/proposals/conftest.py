"""A project with the parameters of this one, and a folder of a stranger's recordings."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

RATE_HZ = 5.0


def drive(seed: int = 0, samples: int = 400, rate_hz: float = RATE_HZ) -> pd.DataFrame:
    """Return a vehicle that is steered in steps: seconds, a command and two states."""
    random = np.random.default_rng(seed)
    return pd.DataFrame(
        {
            "time_s": np.round(np.arange(samples) / rate_hz, 3),
            "rudder_cmd": np.repeat(random.uniform(-1, 1, samples // 20 + 1), 20)[:samples],
            "speed [m/s]": 5 + np.cumsum(random.normal(0, 0.05, samples)),
            "roll (deg)": np.sin(np.arange(samples) / 9) + 0.02 * random.normal(size=samples),
        }
    )


@pytest.fixture
def root(tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The root of a project, where commands run."""
    project = tmp_path / "project"
    project.mkdir()
    shutil.copyfile(request.config.rootpath / "params.yaml", project / "params.yaml")
    monkeypatch.chdir(project)
    return project


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty folder outside of the project."""
    path = tmp_path / "my runs"
    path.mkdir()
    return path


@pytest.fixture
def write(folder: Path) -> Callable[..., None]:
    """Write recordings as CSV: as many as asked for, changed by a function."""

    def write_csv(
        files: int = 3,
        change: Callable[[pd.DataFrame], pd.DataFrame] = lambda table: table,
        samples: int = 400,
        **options: object,
    ) -> None:
        for seed in range(files):
            table = change(drive(seed, samples))
            table.to_csv(folder / f"run {seed}.csv", index=False, **options)

    return write_csv
