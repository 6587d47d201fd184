"""Tracked runs of a three-wheel omnidirectional robot as recordings.

Source: R. Sousa, M. Petry, A. Moreira and P. Costa, repository optiodom, ``data/omni3`` (MIT): 80
runs of 17 to 89 s at 25 Hz on circles, squares and by joystick, with the pose from OptiTrack and
the ticks of the wheels. Velocities are those of the wheels (see ``omni3_runs``).

Held against the pose, differentiated over 0.2 s and turned into the body's frame, all three signs
agree; with each run's offset taken out, wheels and pose correlate by .987 to .996 in each channel
of each manoeuvre. The pose covers 90 to 100 % of the way that the wheels say. The offset is -70 to
60 ms (median: the wheels 20 ms ahead), less than two samples, and is left in: removing it would
look ahead in some runs. Session 211220201842 differs: its wheels' clock drifts against the pose's,
from about 0.7 s behind to level with it, 0.4 s on average.

As written, at 10 Hz and with the offsets, they correlate by .95 to .99 and differ by 0.013 m/s on
circles and squares (0.018 m/s by joystick) and 0.07 rad/s, more than half of which is the pose's
own scatter. The wheels scatter by 0.008 m/s and 0.03 rad/s about a smooth course.
"""

from collections.abc import Iterable, Iterator
from itertools import cycle
from pathlib import Path

import pandas as pd

from odisar.config.sources import Omni3Config
from odisar.errors import OdisarError
from odisar.recordings.schema import UNDISTURBED, Interval, Recording, RecordingInfo
from odisar.recordings.writer import write_recordings
from odisar.sources.fetch import Say, fetch_pinned_folder, read_registry
from odisar.sources.gunnerus import summary_path
from odisar.sources.omni3_runs import (
    FloatArray,
    Robot,
    Run,
    convert_run,
    list_runs,
    read_robot,
    read_run,
)

CASE_NAME = "omni3"

#: Channels in the order of the value array's last axis.
CHANNEL_NAMES = ("Position X", "Position Y", "Heading", "Velocity X", "Velocity Y", "Yaw Rate")

_NOVEL = "novel"
_STAMP_DECIMALS = 6


def fetch_omni3(config: Omni3Config, root: Path, say: Say = print) -> Path:
    """Return the folder of the published files (see ``fetch_pinned_folder``)."""
    return fetch_pinned_folder(config.files, root, say)


def make_omni3(config: Omni3Config, root: Path, folder: Path, say: Say = print) -> list[Path]:
    """Fetch the runs, convert them and write the recordings into ``folder``.

    The summary goes beside the folder (see ``summary_path``). Returns the files written.

    Raises
    ------
    OdisarError
        As ``fetch_omni3`` and ``convert_omni3``.
    """
    published = fetch_omni3(config, root, say)
    runs = list_runs(read_registry(config.files))
    recordings, summary = convert_omni3(published, runs, config, CASE_NAME)
    written = write_recordings(folder, recordings, CHANNEL_NAMES)
    path = summary_path(folder)
    summary.to_csv(path, index=False, float_format="%.2f", lineterminator="\n")
    say(describe_summary(summary))
    return [*written, path]


def convert_omni3(
    published: Path, runs: Iterable[Run], config: Omni3Config, case_name: str
) -> tuple[list[Recording], pd.DataFrame]:
    """Convert published runs to recordings, and account for every run.

    Parameters
    ----------
    published
        The folder of published files.
    runs
        The runs to convert, in the order in which ``split_cycle`` is dealt over them.
    config
        Their conversion.
    case_name
        The case that the recordings say they belong to.

    Returns
    -------
    recordings
        Values (sample, channel) in the order of ``CHANNEL_NAMES``, under the published stamps.
        Runs of a reference manoeuvre are dealt over the splits; those of a novel one are in
        ``test``, labelled novel throughout.
    summary
        One row for every run, written or not: ``recording``, ``maneuver``, ``session``, ``run``,
        ``use``, ``published_s``, ``samples`` and ``seconds`` (written), ``split`` and ``outcome``.

    Raises
    ------
    OdisarError
        A file is missing or is not as published, or ``uses`` or ``excluded`` do not fit the runs.
    """
    runs = list(runs)
    _check_mentioned(runs, config)
    robots = {path: read_robot(published / path) for path in sorted({r.metadata for r in runs})}
    splits = cycle(config.split_cycle)
    recordings: list[Recording] = []
    rows: list[dict[str, object]] = []
    for run, table, outcome in _read(published, runs, config):
        row: dict[str, object] = {
            "recording": run.name,
            "maneuver": run.maneuver,
            "session": run.session,
            "run": run.number,
            "use": config.uses[run.maneuver],
            "published_s": float(table[-1, 0] - table[0, 0]),
            "samples": 0,
            "seconds": 0.0,
            "split": UNDISTURBED,
            "outcome": outcome,
        }
        if outcome == "written":
            split = "test" if row["use"] == _NOVEL else next(splits)
            made = _recording(run, table, robots[run.metadata], split, config, case_name)
            recordings.append(made)
            samples = len(made.time_s)
            row |= {"samples": samples, "seconds": samples / config.rate_hz, "split": split}
        rows.append(row)
    return recordings, pd.DataFrame(rows)


def describe_summary(summary: pd.DataFrame) -> str:
    """Return the conversion summary as text: runs and hours a split, then what was left out."""
    lines = [f"conversion: {summary['published_s'].sum():.1f} s in {len(summary)} runs"]
    used = summary[summary["samples"] > 0]
    for (use, split), group in used.groupby(["use", "split"], sort=True):
        name = f"{split}, novel" if use == _NOVEL else split
        lines.append(
            f"  {name}: {len(group)} run(s) of {group['session'].nunique()} session(s), "
            f"{group['seconds'].sum() / 3600:.2f} h"
        )
    for outcome, group in summary[summary["samples"] == 0].groupby("outcome", sort=True):
        lines.append(f"  {outcome}: {len(group)} run(s), {group['published_s'].sum():.1f} s")
    return "\n".join(lines)


def _check_mentioned(runs: list[Run], config: Omni3Config) -> None:
    """Raise where the configuration and the published runs speak of different things."""
    maneuvers, sessions = {run.maneuver for run in runs}, {run.session for run in runs}
    if unknown := sorted(maneuvers - set(config.uses)):
        raise OdisarError(
            f"sources.omni3.uses does not say what {', '.join(unknown)} is used for; add it"
        )
    if absent := sorted({item.session for item in config.excluded} - sessions):
        raise OdisarError(
            f"sources.omni3.excluded: {', '.join(absent)} is not among the published sessions "
            f"{', '.join(sorted(sessions))}; correct or remove it"
        )


def _read(
    published: Path, runs: Iterable[Run], config: Omni3Config
) -> Iterator[tuple[Run, FloatArray, str]]:
    """Yield every run, its table (sample, 7) and its outcome."""
    reasons = {item.session: item.reason for item in config.excluded}
    for run in runs:
        table = read_run(published / run.path, config)
        outcome = "written"
        if run.session in reasons:
            outcome = f"left out: {reasons[run.session]}"
        elif table[-1, 0] - table[0, 0] < config.minimum_s:
            outcome = f"left out: shorter than minimum_s={config.minimum_s:g}"
        yield run, table, outcome


def _recording(
    run: Run, table: FloatArray, robot: Robot, split: str, config: Omni3Config, case_name: str
) -> Recording:
    novel = config.uses[run.maneuver] == _NOVEL
    time_s, values = convert_run(table, robot, config)
    end_s = round(float(time_s[-1]) + 1.0 / config.rate_hz, _STAMP_DECIMALS)
    return Recording(
        name=run.name,
        info=RecordingInfo(
            case=case_name,
            maneuver=run.maneuver,
            variant=run.session,
            disturbance=_NOVEL if novel else UNDISTURBED,
            components="all" if novel else UNDISTURBED,
            base_seed=run.name,
            split=split,
            extra={"session": run.session, "run": run.number},
        ),
        time_s=time_s,
        values=values,
        intervals=(Interval(float(time_s[0]), end_s, _NOVEL),) if novel else (),
    )
