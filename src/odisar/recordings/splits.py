"""Divide recordings into train, validation, calibration, development and test, before windowing."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from odisar.config.cases import Case
from odisar.errors import OdisarError
from odisar.recordings.blocks import cut_blocks
from odisar.recordings.schema import INDEX_COLUMNS, Recording
from odisar.seeding import generator

#: The parts of a split recording set, in the order in which they are used.
PARTS = ("train", "validation", "calibration", "development", "test")

# Development may be empty: it only serves to choose between detectors.
_NEEDED_PARTS = ("train", "validation", "calibration", "test")
_SELECTED_PARTS = ("train", "validation", "calibration")

Parts = dict[str, list[Recording]]


def assign_splits(
    recordings: Sequence[Recording],
    case: Case,
    setup_select: Mapping[str, list[str]],
    fold: int | None,
    base_seed: int,
) -> Parts:
    """Return the recordings (or blocks of them) of each of ``PARTS``.

    ``info.split`` of what is returned names its part. ``setup_select`` narrows train, validation
    and calibration, never development and test. ``fold`` is for cross-fit alone: its blocks test,
    those of the next fold calibrate, those of the one after validate, all others train;
    disturbed blocks only test.

    Raises
    ------
    OdisarError
        If a part other than development would be empty, if there are too few recordings or
        blocks, or if ``setup_select`` names an unknown column.
    """
    _check_select(recordings, setup_select)
    if case.splits.kind == "cross-fit":
        parts = _cross_fit(recordings, case, fold)
    elif fold is not None:
        raise OdisarError(
            f"fold {fold} was asked for, but splits.kind={case.splits.kind} has no folds"
        )
    elif case.splits.kind == "metadata":
        parts = _by_metadata(recordings)
    else:
        parts = _by_fractions(recordings, case, base_seed)
    _check_not_empty(parts, "no recording is in split {part}: change splits of the case")
    for part in _SELECTED_PARTS:
        parts[part] = [item for item in parts[part] if _is_selected(item, setup_select)]
    wanted = "; ".join(f"{column}: {values}" for column, values in setup_select.items())
    _check_not_empty(parts, f"select ({wanted}) leaves split {{part}} empty: widen it")
    return {
        part: [replace(item, info=replace(item.info, split=part)) for item in parts[part]]
        for part in PARTS
    }


def _check_not_empty(parts: Parts, message: str) -> None:
    for part in _NEEDED_PARTS:
        if not parts[part]:
            raise OdisarError(message.format(part=part))


def _metadata_columns(recording: Recording) -> set[str]:
    return {"case", *INDEX_COLUMNS[1:], *recording.info.extra}


def _check_select(recordings: Sequence[Recording], select: Mapping[str, list[str]]) -> None:
    known = set(INDEX_COLUMNS[1:]).union(*(_metadata_columns(item) for item in recordings))
    for column in select:
        if column not in known:
            raise OdisarError(
                f"select: {column!r} is not a column of the recordings' metadata; "
                f"there are {', '.join(sorted(known))}"
            )


def _is_selected(recording: Recording, select: Mapping[str, list[str]]) -> bool:
    known = _metadata_columns(recording)
    return all(
        (recording.info.column(column) if column in known else "") in values
        for column, values in select.items()
    )


def _empty_parts() -> Parts:
    return {part: [] for part in PARTS}


def _by_metadata(recordings: Sequence[Recording]) -> Parts:
    parts = _empty_parts()
    for recording in recordings:
        if recording.info.split not in parts:
            raise OdisarError(
                f"recording {recording.name}: split {recording.info.split!r} is not one of "
                f"{', '.join(PARTS)}"
            )
        parts[recording.info.split].append(recording)
    return parts


def _by_fractions(recordings: Sequence[Recording], case: Case, base_seed: int) -> Parts:
    """Draw whole clusters of clean recordings; disturbed ones, with their clusters, test."""
    fractions = {str(part): share for part, share in (case.splits.fractions or {}).items()}
    clusters: dict[tuple[str, str], list[Recording]] = {}
    for recording in recordings:
        seed = recording.info.base_seed
        clusters.setdefault(("", recording.name) if not seed else (seed, ""), []).append(recording)
    disturbed = {
        key for key, members in clusters.items() if any(item.info.is_disturbed for item in members)
    }
    clean = sorted(set(clusters) - disturbed)
    if len(clean) < len(fractions):
        raise OdisarError(
            f"splits.kind=fractions needs at least {len(fractions)} recordings without a "
            f"disturbance and with a base_seed of their own; there are {len(clean)}"
        )
    generator(base_seed, "splits", recordings[0].info.case).shuffle(clean)
    counts = _shares(len(clean), [fractions[part] for part in _NEEDED_PARTS])
    part_of = dict.fromkeys(disturbed, "test")
    part_of |= dict(zip(clean, np.repeat(_NEEDED_PARTS, counts).tolist(), strict=True))
    parts = _empty_parts()
    for key, members in clusters.items():
        parts[part_of[key]] += members
    return parts


def _shares(total: int, fractions: Sequence[float]) -> list[int]:
    """Return whole shares of ``total``, none below one, as near to ``fractions`` as can be."""
    counts = [1] * len(fractions)
    for _ in range(total - len(fractions)):
        lacking = [
            fraction * total - count for fraction, count in zip(fractions, counts, strict=True)
        ]
        counts[int(np.argmax(lacking))] += 1
    return counts


def _cross_fit(recordings: Sequence[Recording], case: Case, fold: int | None) -> Parts:
    folds = case.splits.folds or 0
    if fold is None or not 0 <= fold < folds:
        raise OdisarError(f"fold {fold} is not one of the {folds} folds, 0 to {folds - 1}")
    parts = _empty_parts()
    for block in deal_blocks(recordings, case):
        part = {0: "test", 1: "calibration", 2: "validation"}.get(
            ((block.info.fold or 0) - fold) % folds, "train"
        )
        if part == "test" or not block.info.is_disturbed:
            parts[part].append(block)
    positions = dict.fromkeys(PARTS, 0)
    for recording in recordings:
        split = recording.info.split
        if split == "cross-fit":
            continue
        if split not in parts:
            raise OdisarError(f"recording {recording.name}: unknown split {split!r}")
        place = positions[split] if recording.info.fold is None else recording.info.fold
        positions[split] += 1
        if place % folds == fold:
            parts[split].append(recording)
    return parts


def deal_blocks(recordings: Sequence[Recording], case: Case) -> list[Recording]:
    """Return the blocks of all cross-fit recordings, dealt round-robin over the folds in order.

    Raises
    ------
    OdisarError
        If there are fewer blocks than folds.
    """
    folds = case.splits.folds or 0
    blocks = [
        block
        for recording in recordings
        if recording.info.split == "cross-fit"
        for block in cut_blocks(recording, case)
    ]
    if len(blocks) < folds:
        raise OdisarError(
            f"splits.kind=cross-fit needs a block of block_s={case.splits.block_s} for each of "
            f"{folds} folds, but the recordings of split cross-fit give {len(blocks)}: record for "
            "longer, or lower block_s or folds"
        )
    return [
        replace(block, info=replace(block.info, fold=i % folds)) for i, block in enumerate(blocks)
    ]
