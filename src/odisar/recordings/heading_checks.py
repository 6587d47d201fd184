"""Checks of the heading of a pose: z and w of a quaternion about the vertical axis."""

import numpy as np

from odisar.config.cases import Case
from odisar.recordings.quality import Notes
from odisar.recordings.table import Table, note_rows

# z^2 + w^2 of a planar heading: rounded digits and a slight tilt stay within this of 1.
_UNIT_TOLERANCE = 0.02


def check_heading(table: Table, case: Case, notes: Notes) -> None:
    """Note where two channels that are z and w of a quaternion have another length than 1."""
    if case.pose is None or len(case.pose.heading) < 2:
        return
    places = [case.channel_names.index(name) + 1 for name in case.pose.heading]
    if not all(table.present[place] for place in places):
        return
    length = (table.values[:, places] ** 2).sum(axis=1)  # NaN where a value is missing
    wrong = np.abs(length - 1.0) > _UNIT_TOLERANCE
    if wrong.any():
        note_rows(
            notes,
            "error",
            case.pose.heading[0],
            "z and w are no unit quaternion: z^2 + w^2 is not 1",
            f"{table.advice.outside}, or name the channels that are z and w under pose.heading",
            table.lines[wrong],
            length[wrong],
        )
