"""Several processes may work on one study; none of its trials is lost or done twice."""

import os
import subprocess
import sys
from pathlib import Path

import optuna
import pytest

from odisar.twin.tuning import open_storage

SCRIPT = Path(__file__).with_name("tune_shared.py")
TESTS = SCRIPT.parent.parent


@pytest.mark.slow
def test_two_processes_finish_one_study(tmp_path):
    journal = str(tmp_path / "shared.journal")
    path = os.pathsep.join([str(TESTS), str(TESTS.parent / "src")])
    environment = os.environ | {"PYTHONPATH": path}
    command = [sys.executable, str(SCRIPT), journal]
    workers = [subprocess.Popen(command, env=environment) for _ in range(2)]
    assert [worker.wait(timeout=180) for worker in workers] == [0, 0]

    study = optuna.load_study(storage=open_storage(journal), study_name="shared")
    states = [trial.state.name for trial in study.trials]
    # The last trial may be begun by both before either has finished it.
    assert set(states) == {"COMPLETE"}
    assert 6 <= len(states) <= 7
    assert [trial.number for trial in study.trials] == list(range(len(states)))
