"""Make samples of a bag's topics: one at each message of one topic, with what others said last."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case
from odisar.config.formats import BagFormat
from odisar.recordings.bag_topic import Series, TopicReader
from odisar.recordings.quality import Notes
from odisar.recordings.table import BAG, Table, keep_finite, listed, note_rows

_NANOSECONDS = 1_000_000_000


def make_samples(
    readers: Mapping[str, TopicReader], case: Case, layout: BagFormat, notes: Notes
) -> Table | None:
    """Return a sample for each message of the stamp topic, or None if there is none to make.

    Other topics give the last value at or before the sample. Samples before the first message of
    each topic are left out, with a warning.
    """
    series = {topic: reader.series() for topic, reader in readers.items()}
    if not all(one.dated for one in series.values()):
        return None
    stamps = series[layout.stamp_topic]
    for topic, reader in readers.items():
        if topic != layout.stamp_topic:  # whose times are checked as those of any recording
            reader.check_order(series[topic])
    heard = {
        topic: _last_heard(stamps.stamps_ns, other)
        for topic, other in series.items()
        if topic != layout.stamp_topic
    }
    start = _start(stamps, heard, notes)
    if start is None or not stamps.decoded[start:].any():
        return None
    _note_ages(stamps, series, heard, start, layout, notes)
    lines = np.arange(start + 1, len(stamps.stamps_ns) + 1, dtype=np.int64)
    names = [case.source.time_column, *case.channel_names]
    values = np.full((len(lines), len(names)), np.nan)
    present = [True] + [False] * len(case.channels)
    values[:, 0] = _elapsed_s(stamps.stamps_ns[start:], stamps.decoded[start:])
    for topic, reader in readers.items():
        rows = heard.get(topic, np.arange(len(stamps.stamps_ns)))[start:]
        for place, channel in enumerate(reader.channels):
            column = names.index(channel, 1)
            present[column] = True
            values[:, column] = _values(series[topic], rows, place, (channel, lines), notes)
    first_ns = int(stamps.stamps_ns[start:][stamps.decoded[start:]][0])
    started_at = f"{first_ns // _NANOSECONDS}.{first_ns % _NANOSECONDS:09d}"
    return Table(values, lines, tuple(present), BAG, started_at)


def _last_heard(at_ns: NDArray[np.int64], other: Series) -> NDArray[np.int64]:
    """Return (sample,) the number of the last message at or before each time, -1 if none is."""
    usable = np.flatnonzero(other.decoded)
    order = usable[np.argsort(other.stamps_ns[usable], kind="stable")]
    place = np.searchsorted(other.stamps_ns[order], at_ns, side="right") - 1
    return np.where(place >= 0, order[place], -1) if len(order) else np.full(len(at_ns), -1)


def _start(stamps: Series, heard: Mapping[str, NDArray[np.int64]], notes: Notes) -> int | None:
    """Return the first sample at which every topic has spoken; note what comes before it."""
    if not stamps.decoded.any():
        return None
    # A message that could not be decoded has its error; it is not one that came too early.
    ready = np.ones(len(stamps.decoded), dtype=bool)
    for topic, rows in heard.items():
        if not (rows[stamps.decoded] >= 0).any():
            notes.error(
                "no message comes before the last sample",
                "check that both topics have one clock, or set source.bag.stamp: received",
                column=topic,
            )
            return None
        ready &= (rows >= 0) | ~stamps.decoded
    if not ready.any():
        return None
    start = int(np.argmax(ready))
    if start:
        late = [topic for topic, rows in heard.items() if rows[start - 1] < 0]
        notes.warning(
            f"samples before the first message of {listed(late)} are left out",
            "nothing, or start the recorder once every topic speaks",
            row=1,
            value=f"{start} samples",
        )
    return start


def _note_ages(
    stamps: Series,
    series: Mapping[str, Series],
    heard: Mapping[str, NDArray[np.int64]],
    start: int,
    layout: BagFormat,
    notes: Notes,
) -> None:
    lines = np.arange(1, len(stamps.stamps_ns) + 1, dtype=np.int64)
    for topic, rows in heard.items():
        ages_s = (stamps.stamps_ns - series[topic].stamps_ns[rows]) / _NANOSECONDS
        old = (ages_s > layout.max_age_s) & (rows >= 0) & stamps.decoded
        old[:start] = False
        if old.any():
            note_rows(
                notes,
                "error",
                topic,
                f"the last message is older than max_age_s={layout.max_age_s:g}",
                "raise source.bag.max_age_s if values hold for longer, or trim the bag",
                lines[old],
                ages_s[old],
            )


def _elapsed_s(stamps_ns: NDArray[np.int64], decoded: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return seconds since the first sample; whole nanoseconds are subtracted first."""
    elapsed_s = np.full(len(stamps_ns), np.nan)
    elapsed_s[decoded] = (stamps_ns[decoded] - stamps_ns[decoded][0]) / _NANOSECONDS
    return elapsed_s


def _values(
    series: Series,
    rows: NDArray[np.int64],
    place: int,
    target: tuple[str, NDArray[np.int64]],
    notes: Notes,
) -> NDArray[np.float64]:
    """Return (sample,) one field of the messages numbered ``rows``; note what is not finite."""
    channel, lines = target
    values = np.full(len(rows), np.nan)
    known = (rows >= 0) & series.sound[rows, place]
    values[known] = keep_finite(
        series.values[rows[known], place], lines[known], channel, BAG.leave_out, notes
    )
    return values
