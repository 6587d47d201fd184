"""Cut a long recording into blocks that can be held out from one another."""

from dataclasses import replace

import numpy as np

from odisar.config.cases import Case
from odisar.recordings.schema import UNDISTURBED, Interval, Recording


def cut_blocks(recording: Recording, case: Case) -> list[Recording]:
    """Return the blocks of ``splits.block_s`` seconds, ``splits.block_gap_s`` apart.

    No block crosses a gap, and what is left of a segment after its last whole block is in none.
    Times stay those of the recording; labels are clipped to the block, and a block that none of
    them reaches is undisturbed. Every block is a cluster of its own.
    """
    block_steps = max(round((case.splits.block_s or 0.0) * case.rate_hz), 1)
    gap_s = case.splits.block_gap_s or 0.0
    period_s = 1.0 / case.rate_hz
    blocks: list[Recording] = []
    earliest_s = -np.inf
    for start, stop in recording.segments:
        first = start + int(np.searchsorted(recording.time_s[start:stop], earliest_s - 1e-6))
        while first + block_steps <= stop:
            last = first + block_steps
            blocks.append(_block(recording, first, last, len(blocks), period_s))
            earliest_s = float(recording.time_s[last - 1]) + period_s + gap_s
            first = start + int(np.searchsorted(recording.time_s[start:stop], earliest_s - 1e-6))
    return blocks


def _block(recording: Recording, first: int, last: int, number: int, period_s: float) -> Recording:
    name = f"{recording.name}-block-{number:02d}"
    time_s = recording.time_s[first:last].copy()
    start_s, end_s = float(time_s[0]), float(time_s[-1]) + period_s
    clipped = (
        Interval(max(interval.start_s, start_s), min(interval.end_s, end_s), interval.label)
        for interval in recording.intervals
    )
    intervals = tuple(interval for interval in clipped if interval.start_s < interval.end_s)
    info = replace(recording.info, base_seed=name)
    if recording.intervals and not intervals:  # disturbed, but not here
        info = replace(info, disturbance=UNDISTURBED, components=UNDISTURBED, strength=None)
    return replace(
        recording,
        name=name,
        info=info,
        time_s=time_s,
        values=recording.values[first:last].copy(),
        intervals=intervals,
        segments=((0, last - first),),
    )
