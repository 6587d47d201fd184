import os
import time

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


def test_a_single_job_starts_no_process():
    assert run_jobs(slow_square, [3], 8) == [(9, os.getpid())]
