import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from odisar.errors import OdisarError
from odisar.stages.parallel import run_jobs


def slow_square(number: int) -> tuple[int, int]:
    """Return the square and the process; the first jobs take longest."""
    time.sleep(max(0.0, 0.3 - 0.1 * number))
    return number**2, os.getpid()


def fail_at_two(number: int) -> int:
    if number == 2:
        raise OdisarError("job 2 cannot be done")
    return number


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_the_order_of_the_jobs(workers):
    squares, processes = zip(*run_jobs(slow_square, range(4), workers), strict=True)
    assert squares == (0, 1, 4, 9)
    assert (os.getpid() in processes) == (workers == 1)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_failure_comes_out_as_it_was_raised(workers):
    with pytest.raises(OdisarError, match="job 2 cannot be done"):
        run_jobs(fail_at_two, range(4), workers)


def begin(given: tuple[Path, int]) -> None:
    folder, number = given
    (folder / str(number)).touch()
    if number == 0:
        raise OdisarError("job 0 cannot be done")
    time.sleep(1.0)


@pytest.mark.parametrize("workers", [1, 2])
def test_after_a_failure_no_further_job_is_begun(tmp_path, workers):
    with pytest.raises(OdisarError, match="job 0 cannot be done"):
        run_jobs(begin, [(tmp_path, number) for number in range(6)], workers)
    assert {path.name for path in tmp_path.iterdir()} == {str(n) for n in range(workers)}


def test_a_single_job_starts_no_process():
    assert run_jobs(slow_square, [3], 8) == [(9, os.getpid())]


PREPARED = """
import sys
from odisar.stages.parallel import prepare_jobs, run_jobs
from test_parallel import is_loaded
if __name__ == "__main__":
    workers = int(sys.argv[1])
    prepare_jobs("wave", workers)
    assert not is_loaded("wave")
    print(run_jobs(is_loaded, ["wave", "sched"], 2))
"""


def is_loaded(module: str) -> bool:
    return module in sys.modules


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is prepared")
@pytest.mark.parametrize("workers", [1, 2])
def test_processes_have_what_was_prepared_for_them_loaded_and_nothing_else(tmp_path, workers):
    script = tmp_path / "prepared.py"
    script.write_text(PREPARED)
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, script, str(workers)],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    # One worker needs no server: its jobs stay in this process.
    assert done.stdout.strip() == str([workers == 2, False])


def tell_process_and_sleep(path: Path) -> None:
    path.write_text(str(os.getpid()))
    time.sleep(120)


STARTED = """
import sys
from pathlib import Path
from test_parallel import tell_process_and_sleep
from odisar.stages.parallel import run_jobs
if __name__ == "__main__":
    run_jobs(tell_process_and_sleep, [Path(name) for name in sys.argv[1:]], 2)
"""


INTERRUPTED = """
import signal
import sys
from pathlib import Path
from test_parallel import tell_process_and_sleep
from odisar.stages.parallel import prepare_jobs, run_jobs
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # not so in background
    prepare_jobs("odisar.errors", 2)
    try:
        run_jobs(tell_process_and_sleep, [Path(name) for name in sys.argv[1:]], 2)
    except KeyboardInterrupt:
        print("interrupted")
"""


def test_ctrl_c_ends_what_runs_and_begins_nothing_more(tmp_path):
    script, paths = tmp_path / "interrupted.py", [tmp_path / name for name in "abcd"]
    script.write_text(INTERRUPTED)
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    parent = subprocess.Popen(
        [sys.executable, script, *paths],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while sum(p.exists() and bool(p.read_text()) for p in paths) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    os.killpg(parent.pid, signal.SIGINT)
    said, _ = parent.communicate(timeout=30)
    assert said == "interrupted\n"
    assert sum(p.exists() for p in paths) == 2


PREPARING = """
import signal
import time
from odisar.stages.parallel import prepare_jobs
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # not so in background
    prepare_jobs("odisar.stages.train", 2)
    print("preparing", flush=True)
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        print("interrupted")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is prepared")
def test_ctrl_c_while_libraries_are_imported_ends_in_no_traceback(tmp_path):
    script = tmp_path / "preparing.py"
    script.write_text(PREPARING)
    parent = subprocess.Popen(
        [sys.executable, script],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert parent.stdout.readline() == "preparing\n"
    time.sleep(0.5)  # the server has begun to import torch, which takes longer
    os.killpg(parent.pid, signal.SIGINT)
    assert parent.communicate(timeout=60) == ("interrupted\n", "")


def is_running(process: int) -> bool:
    # A zombie has ended: nobody has asked for its exit code yet.
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks /proc for processes")
def test_whoever_is_killed_leaves_no_process_behind(tmp_path):
    script, paths = tmp_path / "started.py", [tmp_path / "one", tmp_path / "two"]
    script.write_text(STARTED)
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, script, *paths]
    parent = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": path})
    deadline = time.monotonic() + 60
    while not all(p.exists() and p.read_text() for p in paths):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    workers = [int(path.read_text()) for path in paths]
    assert all(map(is_running, workers))
    parent.send_signal(signal.SIGKILL)
    parent.wait(timeout=10)
    while any(map(is_running, workers)):
        assert time.monotonic() < deadline
        time.sleep(0.05)
