"""A training killed by SIGKILL and started again ends where an unbroken one ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

SCRIPT = Path(__file__).with_name("train_in_steps.py")
TESTS = SCRIPT.parent.parent


def start(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    path = os.pathsep.join([str(TESTS), str(TESTS.parent / "src")])
    environment = os.environ | {"PYTHONPATH": path}
    command = [sys.executable, str(SCRIPT), str(folder), *arguments]
    return subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)


@pytest.mark.slow
def test_killed_and_resumed_equals_unbroken(tmp_path):
    unbroken, broken = tmp_path / "unbroken", tmp_path / "broken"
    assert start(unbroken).wait(timeout=120) == 0

    victim = start(broken, "--slowly")
    deadline = time.monotonic() + 60
    while not (broken / "last.ckpt").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.25)  # into the middle of a later epoch
    victim.send_signal(signal.SIGKILL)
    victim.wait()
    assert (broken / "last.ckpt").exists()
    assert not (broken / "final.safetensors").exists(), "it ended before it could be killed"

    assert start(broken).wait(timeout=120) == 0
    expected, found = (load_file(folder / "final.safetensors") for folder in (unbroken, broken))
    for name, weight in expected.items():
        torch.testing.assert_close(found[name], weight, atol=1e-6, rtol=0)
    assert (broken / "epochs.txt").read_text() == "[0, 1, 2, 3]"
