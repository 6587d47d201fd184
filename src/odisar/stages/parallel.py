"""Run the members of a stage side by side, one process and one torch thread each."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

from tqdm import tqdm

Job = TypeVar("Job")
Result = TypeVar("Result")


def show_progress(items: Sequence[Job], name: str, position: int) -> Iterable[Job]:
    """Yield the items below a bar at ``position``; on a terminal only."""
    shown: Iterable[Job] = tqdm(items, desc=name, unit="recording", position=position, disable=None)
    return shown


def run_jobs(function: Callable[[Job], Result], jobs: Sequence[Job], workers: int) -> list[Result]:
    """Return ``function(job)`` of every job, in order.

    After a failure no further job is begun; those that run are waited for.

    With one worker or one job everything stays in this process: starting another costs seconds
    of imports. ``function`` must be a module's top-level function.
    """
    if min(workers, len(jobs)) <= 1:
        return [function(job) for job in jobs]
    with ProcessPoolExecutor(min(workers, len(jobs)), mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(function, job) for job in jobs]
        try:
            return [future.result() for future in futures]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
