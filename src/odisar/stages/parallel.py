"""Run the members of a stage side by side, one process and one torch thread each."""

import os
import signal
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from functools import partial
from itertools import islice
from multiprocessing import forkserver, get_context, parent_process
from threading import Thread
from typing import TypeVar

from tqdm import tqdm

Job = TypeVar("Job")
Result = TypeVar("Result")

#: Processes are copies of a server that has imported everything and begun nothing. Elsewhere than
#: on Linux each imports for itself: there a copy of a process may lack what libraries need.
_START = "forkserver" if sys.platform == "linux" else "spawn"


def prepare_jobs(module: str, workers: int) -> None:
    """Let the server of ``run_jobs`` import a module, while this process goes on.

    Imports of the libraries take seconds: so they are done once, beside this process's own. Of a
    process the first call counts, and the environment of that moment.
    """
    if workers > 1 and _START == "forkserver":
        get_context(_START).set_forkserver_preload([module])
        # While it imports, the server would answer Ctrl-C with a traceback.
        answer = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            forkserver.ensure_running()
        finally:
            signal.signal(signal.SIGINT, answer)


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
    # What was started in the background of a script is meant to go on.
    answers = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    begin = partial(_begin_process, answers=answers)
    with ProcessPoolExecutor(min(workers, len(jobs)), start, begin) as pool:
        return _run_in_turn(pool, function, jobs, workers)


def _run_in_turn(
    pool: Executor, function: Callable[[Job], Result], jobs: Sequence[Job], workers: int
) -> list[Result]:
    """Hand over as many jobs as there are workers: what waits in a pool can't be called back."""
    left = iter(range(len(jobs)))
    running: dict[Future[Result], int] = {}
    results: dict[int, Result] = {}
    ended = workers
    while True:
        for number in islice(left, ended):
            running[pool.submit(function, jobs[number])] = number
        if not running:
            return [results[number] for number in range(len(jobs))]
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        results |= {running.pop(future): future.result() for future in done}
        ended = len(done)


def _begin_process(*, answers: bool) -> None:
    """Answer Ctrl-C as the parent does, and end as soon as that one is gone, killed or not.

    A pool's processes don't notice by themselves: they would finish their job for nobody, and then
    wait for another for ever.
    """
    # The server, which was started without, hands its deafness on.
    if answers:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    parent = parent_process()
    if parent is not None:
        Thread(target=_exit_after, args=(parent.join,), daemon=True).start()


def _exit_after(wait: Callable[[], None]) -> None:
    wait()
    os._exit(1)
