"""Run the members of a stage side by side, one process and one torch thread each."""

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import forkserver, get_all_start_methods, get_context, parent_process
from threading import Thread
from typing import TypeVar

from tqdm import tqdm

Job = TypeVar("Job")
Result = TypeVar("Result")

#: Processes are copies of a server that has imported everything and done nothing, where the system
#: can do that; elsewhere each imports for itself.
_START = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"


def prepare_jobs(module: str, workers: int) -> None:
    """Let the server of ``run_jobs`` import a module, while this process goes on.

    Imports of the libraries take seconds: so they are done once, beside this process's own.
    """
    if workers > 1 and _START == "forkserver":
        get_context(_START).set_forkserver_preload([module])
        forkserver.ensure_running()


def show_progress(items: Sequence[Job], name: str, position: int) -> Iterable[Job]:
    """Yield the items below a bar at ``position``; on a terminal only."""
    shown: Iterable[Job] = tqdm(items, desc=name, unit="recording", position=position, disable=None)
    return shown


def run_jobs(function: Callable[[Job], Result], jobs: Sequence[Job], workers: int) -> list[Result]:
    """Return ``function(job)`` of every job, in order.

    After a failure no further job is begun; those that run are waited for.

    With one worker or one job everything stays in this process: starting another costs time, if
    ``prepare_jobs`` wasn't called seconds of imports. ``function`` must be a module's top-level
    function.
    """
    if min(workers, len(jobs)) <= 1:
        return [function(job) for job in jobs]
    start = get_context(_START)
    with ProcessPoolExecutor(min(workers, len(jobs)), start, _end_with_parent) as pool:
        futures = [pool.submit(function, job) for job in jobs]
        try:
            return [future.result() for future in futures]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _end_with_parent() -> None:
    """End this process as soon as the one that started it is gone, killed or not.

    A pool's processes don't notice by themselves: they would finish their job for nobody, and then
    wait for another for ever.
    """
    parent = parent_process()
    if parent is not None:
        Thread(target=_exit_after, args=(parent.join,), daemon=True).start()


def _exit_after(wait: Callable[[], None]) -> None:
    wait()
    os._exit(1)
