"""Propose a profile for a folder of recordings: look, guess, read everything, decide."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from odisar.config.cases import Case
from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.proposals.bag_sniffing import BAG_TIME
from odisar.proposals.channels import guess_channels, heading_limit, pick_columns
from odisar.proposals.columns import TEXT, Column, read_columns, widened
from odisar.proposals.conversion import require_readable
from odisar.proposals.draft import Draft
from odisar.proposals.gathering import Look, look_into
from odisar.proposals.guesses import Guess
from odisar.proposals.plans import Extent, Wishes, make_plan, shortest_plan
from odisar.proposals.poses import PoseGuess, guess_pose
from odisar.proposals.samples import names
from odisar.proposals.text_columns import columns_of_text, without_advice
from odisar.proposals.times import (
    SECONDS_DOUBT,
    Pace,
    TimeColumn,
    find_time,
    measure_pace,
    nice_rate,
)
from odisar.proposals.writing import check_name, checked_config
from odisar.proposals.yaml_text import scalar
from odisar.recordings.reader import ReadResult, read_case
from odisar.recordings.schema import Recording

# Above this a window of a usual number of steps would be too short to see a machine move.
_FAST_HZ = 25.0
_SLOWED_TO_HZ = 10.0
_NO_LIMIT = 1e12
_SLOW_HZ = 0.2
_NO_WISHES = Wishes()


@dataclass(frozen=True)
class Proposal:
    """A profile's text, the case it declares, and what reading the recordings with it found."""

    name: str
    text: str
    case: Case
    result: ReadResult
    remarks: tuple[str, ...]
    left_out: tuple[str, ...]
    files: int


def propose(
    root: Path,
    folder: Path,
    name: str | None,
    say: Callable[[str], None],
    *,
    write: bool,
    wishes: Wishes = _NO_WISHES,
) -> Proposal:
    """Return a proposal for the recordings in a folder; ``wishes`` are kept where they can be.

    ``say`` is told what takes long. Raises OdisarError where nothing sensible can be proposed,
    with what to do.
    """
    name = name or _name_of(folder)
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
        raise OdisarError(f"--name {name!r}: use letters, digits, - and _, a letter or digit first")
    check_name(root, name, write=write)
    wishes.check()
    look = look_into(folder)
    say(f"reading {len(look.files)} recording(s) in {folder} ...")
    time = TimeColumn(BAG_TIME, 1.0, False, False, "") if look.bag else None  # noqa: FBT003
    time = time or find_time(look.samples, look.columns)
    require_readable(look.samples, time, folder)
    pace = measure_pace([time.seconds(sample) for sample in look.samples])
    first, columns = _first_draft(root, look, time, pace, name, wishes)
    case = checked_config(root, name, first.text()).cases[name]
    tried = read_case(name, case, root)
    text_columns = columns_of_text(look, tried.findings)
    told = [f"{column} ({TEXT})" for column in text_columns if column not in look.columns]
    first = replace(first, left_out=[*first.left_out, *told])
    draft = _second_draft(root, first, look, columns, tried.recordings, wishes)
    text = draft.text()
    case = checked_config(root, name, text).cases[name]
    result = without_advice(read_case(name, case, root), text_columns)
    remarks = (*_time_remarks(time), *look.remarks)
    left_out = tuple({*look.columns, *text_columns} - {time.name, *case.channel_names})
    return Proposal(name, text, case, result, remarks, left_out, len(look.files))


def _name_of(folder: Path) -> str:
    """Return a name for a case after its folder."""
    slug = re.sub(r"[^A-Za-z0-9_-]+", "-", folder.resolve().name).strip("-_").lower()
    return slug if re.match(r"[a-z]\w", slug) and scalar(slug) == slug else f"case-{slug or 'own'}"


def _first_draft(
    root: Path, look: Look, time: TimeColumn, pace: Pace, name: str, wishes: Wishes
) -> tuple[Draft, list[Column]]:
    """Return a draft without limits, to read every recording with, and its channels' columns."""
    candidates = [column for column in look.columns if column != time.name]
    columns, left_out = read_columns(look.samples, candidates)
    if not columns:
        reasons = "; ".join(f"'{column}': {reason}" for column, reason in left_out.items())
        raise OdisarError(
            f"{look.samples[0].path.name}: no column besides '{time.name}' can be a channel "
            f"({reasons or 'there is none'}). A channel is a column of numbers that change"
        )
    columns, surplus = pick_columns(columns)
    guesses, pose = _guesses(look, columns)
    patch_steps = load_config(root).twin.patch_steps
    extent = Extent(
        ((len(look.samples[0].table),),), pace.rate_hz, 1, look.has_labels, look.has_splits
    )
    rate_hz, is_held, doubt = _chosen_rate(pace, wishes.rate_hz)
    told = [f"{column} ({reason})" for column, reason in left_out.items()]
    told += [f"{column} (too many channels)" for column in surplus]
    draft = Draft(
        name=name,
        folder=_declared(root, look.folder),
        title=look.folder.resolve().name or name,
        time_column=time.name,
        time_doubt=_time_doubt(time, pace),
        layout=look.samples[0].layout,
        bag=look.bag,
        rate_hz=rate_hz,
        rate_doubt=doubt,
        is_held=is_held,
        pace=pace,
        guesses=[replace(guess, low=-_NO_LIMIT, high=_NO_LIMIT) for guess in guesses],
        left_out=told,
        pose=pose,
        extent=extent,
        plan=shortest_plan(patch_steps, has_splits=look.has_splits),
    )
    return draft, columns


def _second_draft(
    root: Path,
    draft: Draft,
    look: Look,
    columns: Sequence[Column],
    recordings: Sequence[Recording],
    wishes: Wishes,
) -> Draft:
    """Return the draft with limits and lengths that fit all that could be read."""
    seen = [
        widened(column, [recording.values[:, place] for recording in recordings])
        for place, column in enumerate(columns)
    ]
    guesses, _ = _guesses(look, seen)
    segments = [
        tuple(stop - start for start, stop in recording.segments) for recording in recordings
    ]
    if not segments:  # none could be read: plan by what was looked at
        scale = draft.rate_hz / draft.pace.rate_hz
        segments = [(round(scale * len(sample.table)),) for sample in look.samples]
    clean = sum(not recording.info.is_disturbed for recording in recordings) or len(segments)
    extent = Extent(tuple(segments), draft.rate_hz, clean, look.has_labels, look.has_splits)
    patch_steps = load_config(root).twin.patch_steps
    plan = make_plan(extent, patch_steps, wishes)
    return replace(draft, guesses=guesses, extent=extent, plan=plan)


def _guesses(look: Look, columns: Sequence[Column]) -> tuple[list[Guess], PoseGuess | None]:
    """Return guesses of channels and pose; a heading gets the unit that its pose needs."""
    fields = look.bag.fields if look.bag else ()
    guesses = guess_channels(columns, look.samples[0].units, fields)
    pose = guess_pose(guesses, columns)
    if pose is None:
        return guesses, None
    settled = []
    for guess in guesses:
        if guess.name in pose.heading:
            guess = _heading(guess, pose)  # noqa: PLW2901
        elif guess.name in (pose.x, pose.y):
            guess = _place(guess)  # noqa: PLW2901
        settled.append(guess)
    return settled, pose


def _heading(guess: Guess, pose: PoseGuess) -> Guess:
    """Return a heading with the unit and the limits that its pose needs; x and y are forecast."""
    if len(pose.heading) > 1:
        return replace(guess, output=False, doubts=())
    unit = pose.heading_unit or guess.unit
    most = heading_limit(unit)
    guessed = pose.heading_unit or "unit guessed from the range" in guess.doubts
    doubts = ("unit guessed from the range",) if guessed else ()
    return replace(guess, unit=unit, output=False, low=-most, high=most, doubts=doubts)


def _place(guess: Guess) -> Guess:
    """Return a coordinate of a pose, in metres where nothing else is known."""
    if guess.unit != "1":
        return replace(guess, output=True)
    doubts = tuple("unit guessed" if doubt == "unit unknown" else doubt for doubt in guess.doubts)
    return replace(guess, output=True, unit="m", doubts=doubts)


def _chosen_rate(pace: Pace, wish_hz: float | None) -> tuple[float, bool, str]:
    """Return the rate that is wished for, or else the one that suits the recordings."""
    if wish_hz is None:
        return _rate(pace)
    if wish_hz > 1.009 * pace.slowest_hz:
        raise OdisarError(
            f"--rate-hz {wish_hz:g}: samples come at {pace.slowest_hz:.4g} Hz; give no more"
        )
    is_recorded = pace.is_even and abs(wish_hz / pace.rate_hz - 1) < 0.001
    return wish_hz, not is_recorded, ""


def _rate(pace: Pace) -> tuple[float, bool, str]:
    """Return the rate to work at, whether samples are held for it, and what is doubtful."""
    if pace.rate_hz <= _FAST_HZ:
        is_held = not pace.is_even
        rate_hz = pace.rate_hz
        if is_held and pace.slowest_hz < 0.991 * rate_hz:
            rate_hz = nice_rate(pace.slowest_hz)[0]
            rate_hz = rate_hz if rate_hz <= pace.slowest_hz * 1.009 else pace.slowest_hz * 0.995
        return float(f"{rate_hz:.6g}"), is_held, pace.doubt
    doubt = (
        f"recorded at {pace.rate_hz:g} Hz; 60 samples of that are only {60 / pace.rate_hz:.2g} s"
    )
    return _SLOWED_TO_HZ, True, doubt


def _declared(root: Path, folder: Path) -> str:
    """Return a folder as the case declares it: below the project from its root, else absolute."""
    path = folder.resolve()
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else path.as_posix()


def _time_doubt(time: TimeColumn, pace: Pace) -> str:
    if time.doubt != SECONDS_DOUBT or pace.rate_hz > _SLOW_HZ:
        return time.doubt
    return f"{time.doubt}, {1 / pace.rate_hz:g} s apart; or does it count milliseconds?"


def _time_remarks(time: TimeColumn) -> list[str]:
    if not time.is_epoch:
        return []
    return [f"column {names([time.name])} is a clock since 1970, in seconds: taken as it is"]


def unsure_of(text: str) -> list[str]:
    """Return what a proposal's text marks with ``# ?``, key by key."""
    found: list[str] = []
    limits: list[str] = []
    for line in text.splitlines():
        body, mark, doubt = line.partition("# ? ")
        if not mark:
            continue
        entry = re.search(r'\{name: ("(?:[^"\\]|\\.)*"|[^,]+),', body)
        key = entry[1].strip('"') if entry else body.strip().partition(":")[0]
        told, seen, _ = doubt.partition("limits: seen")
        if seen:
            limits.append(key)
        if told.strip("; "):
            found.append(f"{key}: {told.strip('; ')}")
    if limits:
        found.append(f"min and max, guessed from what was seen, of {', '.join(limits)}")
    return found


def gap_free_hours(recordings: Sequence[Recording]) -> float:
    """Return the recorded time without gaps, in hours."""
    lengths = [
        recording.time_s[stop - 1] - recording.time_s[start]
        for recording in recordings
        for start, stop in recording.segments
    ]
    return float(np.sum(lengths)) / 3600.0
