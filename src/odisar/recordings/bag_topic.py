"""The messages of one topic of a ROS 2 bag: the numbers wanted of them, and their times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection

from odisar.recordings.bag_definitions import FieldFaultError, definitions
from odisar.recordings.bag_fields import Getter, has_header, resolve
from odisar.recordings.quality import Notes
from odisar.recordings.table import BAG, note_rows

_NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Series:
    """A topic's messages in the order of the bag.

    ``stamps_ns`` (message,) are on the chosen clock; ``values`` (message, channel) are NaN where
    ``sound`` (message, channel) is false: that is in the notes already. ``decoded`` (message,) is
    false where a message told nothing, not even its time; ``dated`` is false where a message's
    header has no stamp.
    """

    stamps_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    sound: NDArray[np.bool_]
    decoded: NDArray[np.bool_]
    dated: bool


class TopicReader:
    """Collects what is wanted of one topic's messages, one message after the other."""

    def __init__(
        self, connection: Connection, paths: Mapping[str, str], clock: str, notes: Notes
    ) -> None:
        self.topic = connection.topic
        self._msgtype = connection.msgtype
        self._notes = notes
        self._store = definitions(connection)
        self.stamped = has_header(self._store, self._msgtype)
        self._by_header = clock == "header" and self.stamped
        self._getters: dict[str, Getter] = {}
        for channel, path in paths.items():
            try:
                self._getters[channel] = resolve(self._store, self._msgtype, path)
            except FieldFaultError as fault:
                notes.error(fault.problem, fault.remedy, column=channel, value=path)
        self._paths = paths
        self._stamps: list[int] = []
        self._values: list[Sequence[float]] = []
        self._decoded: list[bool] = []
        self._unsound: list[tuple[int, int]] = []

    @property
    def channels(self) -> list[str]:
        """The channels whose fields the topic's messages have."""
        return list(self._getters)

    def __len__(self) -> int:
        """Return the number of messages so far."""
        return len(self._stamps)

    def add(self, received_ns: int, raw: bytes) -> None:
        """Take one message; what is wrong with it goes to the notes, and its values are NaN."""
        try:
            message = self._store.deserialize_cdr(raw, self._msgtype)
        except Exception as fault:  # noqa: BLE001 - bytes of another kind make it raise anything
            self._notes.error(
                "the message cannot be decoded",
                "check that the recorder knew the message's definition; trim the bag, or record "
                "again",
                column=self.topic,
                row=len(self) + 1,
                value=" ".join(str(fault).split()),
            )
            self._unsound += [(len(self), i) for i in range(len(self._getters))]
            self._append(received_ns, [np.nan] * len(self._getters), decoded=False)
            return
        values = [self._get(channel, i, message) for i, channel in enumerate(self._getters)]
        self._append(_stamp(message) if self._by_header else received_ns, values, decoded=True)

    def _get(self, channel: str, place: int, message: Any) -> float:
        try:
            return self._getters[channel](message)
        except IndexError:
            path = self._paths[channel]
            self._notes.error(
                f"a message of {self.topic} has too few elements for {path}",
                "take a smaller index, or trim the bag",
                column=channel,
                row=len(self) + 1,
            )
        self._unsound.append((len(self), place))
        return np.nan

    def _append(self, stamp_ns: int, values: Sequence[float], *, decoded: bool) -> None:
        self._stamps.append(stamp_ns)
        self._values.append(values)
        self._decoded.append(decoded)

    def series(self) -> Series:
        """Return all messages so far; stamps that are not filled in go to the notes."""
        stamps_ns = np.array(self._stamps, dtype=np.int64)
        decoded = np.array(self._decoded, dtype=bool)
        shape = (len(stamps_ns), len(self._getters))
        sound = np.ones(shape, dtype=bool)
        for row, place in self._unsound:
            sound[row, place] = False
        dated = not self._by_header or self._is_dated(stamps_ns, decoded)
        values = np.array(self._values, dtype=np.float64).reshape(shape)
        return Series(stamps_ns, values, sound, decoded, dated)

    def _is_dated(self, stamps_ns: NDArray[np.int64], decoded: NDArray[np.bool_]) -> bool:
        """Return whether every header has a stamp; note those that have none."""
        blank = decoded & (stamps_ns == 0)
        if not blank.any():
            return True
        if blank[decoded].all():
            self._notes.error(
                "the stamp of every header is 0",
                "set source.bag.stamp: received, or mend the driver: it does not fill the header",
                column=self.topic,
                value="0",
            )
            return False
        rows = np.flatnonzero(blank) + 1
        note_rows(
            self._notes,
            "error",
            self.topic,
            "the stamp of the header is 0",
            "set source.bag.stamp: received, or trim the first messages",
            rows,
            np.zeros(len(rows)),
        )
        return False

    def check_order(self, series: Series) -> None:
        """Note where the clock in the headers jumps back: its later messages would seem earlier.

        Times of arrival need no check: a bag has its messages in the order of those.
        """
        if not self._by_header:
            return
        usable = np.flatnonzero(series.decoded)
        stamps_ns = series.stamps_ns[usable]
        back = np.flatnonzero(np.diff(stamps_ns) < 0) + 1
        if len(back):
            rows, stamps_s = usable[back] + 1, stamps_ns[back] / _NANOSECONDS
            note_rows(
                self._notes,
                "error",
                self.topic,
                "the time goes back",
                BAG.backward,
                rows,
                stamps_s,
            )


def _stamp(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)
