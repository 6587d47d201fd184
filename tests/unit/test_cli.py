"""What holds before any command runs."""

import json
import os
import subprocess
import sys

LOADED = """
from odisar.cli import main
code = main(["stage", "none-such"])
import json
from threadpoolctl import threadpool_info
print(json.dumps({"code": code, "threads": [part["num_threads"] for part in threadpool_info()]}))
"""
VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def loaded() -> dict:
    """Return the exit code of a command, and the threads of the libraries it has loaded."""
    kept = {name: value for name, value in os.environ.items() if name not in VARIABLES}
    command = [sys.executable, "-c", LOADED]
    done = subprocess.run(
        command, env=kept, capture_output=True, text=True, check=True, timeout=120
    )
    return json.loads(done.stdout)


def test_numerical_libraries_have_one_thread_each_as_processes_share_the_cores():
    found = loaded()
    assert found["code"] == 1
    assert found["threads"]
    assert set(found["threads"]) == {1}
