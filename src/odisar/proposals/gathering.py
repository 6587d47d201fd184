"""Look at the recordings in a folder: some of them closely, and what they have in common."""

import contextlib
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from odisar.errors import OdisarError
from odisar.proposals.bag_sniffing import BagLook, sniff_bags
from odisar.proposals.csv_sniffing import sniff_csv
from odisar.proposals.parquet_sniffing import sniff_parquet
from odisar.proposals.samples import Sample, UnusableError, names, none_usable
from odisar.recordings.folder import BAG_METADATA, INDEX_FILE, LABELS_FILE, Format, format_of

_FILES_LOOKED_AT = 8
_BAGS_LOOKED_AT = 3


@dataclass(frozen=True)
class Look:
    """What was seen in a folder: ``columns`` are those that all ``samples`` have."""

    folder: Path
    files: tuple[Path, ...]
    samples: tuple[Sample, ...]
    columns: tuple[str, ...]
    bag: BagLook | None
    remarks: tuple[str, ...]
    has_labels: bool
    has_splits: bool


def look_into(folder: Path) -> Look:
    """Look at the recordings in a folder.

    Raises
    ------
    OdisarError
        If the folder is none, holds no recording, or none that can be understood.
    """
    files = _recordings(folder)
    by_kind: dict[str, list[Path]] = {"table": [], "bag": []}
    for path, form in files.items():
        by_kind["bag" if form == "bag" else "table"].append(path)
    kind = "bag" if len(by_kind["bag"]) > len(by_kind["table"]) else "table"
    chosen, others = by_kind[kind], by_kind["table" if kind == "bag" else "bag"]
    remarks = []
    if others:
        remarks.append(
            f"tables and bags lie together: {names([path.name for path in others], 4)} would need "
            "the same channel names; move them into a folder (and a case) of their own"
        )
    picked = _spread(chosen, _BAGS_LOOKED_AT if kind == "bag" else _FILES_LOOKED_AT)
    if len(picked) < len(chosen):
        remarks.append(f"{len(picked)} of {len(chosen)} recordings were looked at for the proposal")
    bag = _look_at_bags(picked, chosen, folder) if kind == "bag" else None
    samples, seen = (
        (bag.samples, _unusable_remarks(bag.unusable)) if bag else _look_at_tables(picked, chosen)
    )
    samples, columns, odd = _common(samples)
    remarks += [*seen, *odd]
    remarks += [f"{item.path.name}: {remark}" for item in samples[:2] for remark in item.remarks]
    return Look(
        folder,
        tuple(files),
        samples,
        columns,
        bag,
        tuple(remarks),
        (folder / LABELS_FILE).is_file(),
        _index_has_splits(folder / INDEX_FILE),
    )


def _recordings(folder: Path) -> dict[Path, Format]:
    """Return what the pipeline would read in a folder; the rest is named by the quality check."""
    entries = _entries(folder)
    if any(path.name == BAG_METADATA for path in entries):
        raise OdisarError(
            f"{folder} is itself a ROS 2 bag; give the folder that holds it: {folder.parent}"
        )
    found: dict[Path, Format] = {}
    for path in entries:
        if path.name.startswith(".") or path.name in (INDEX_FILE, LABELS_FILE):
            continue
        with contextlib.suppress(KeyError):  # none of the formats
            found[path] = format_of(path)
    if not found:
        raise OdisarError(f"{folder} holds no recording: {_instead(entries)}")
    return found


def _entries(folder: Path) -> list[Path]:
    if not folder.exists():
        raise OdisarError(f"{folder}: there is no such folder; say where the recordings lie")
    if not folder.is_dir():
        raise OdisarError(
            f"{folder} is a file; give the folder that holds it (each file in it is a recording)"
        )
    try:
        return sorted(folder.iterdir(), key=lambda path: path.name)
    except OSError as fault:
        raise OdisarError(f"{folder} cannot be read ({fault.strerror})") from fault


def _instead(entries: Sequence[Path]) -> str:
    """Say what is there in place of recordings, and what to do."""
    wanted = "put a CSV file, a Parquet file or a ROS 2 bag for each recording into it"
    nested = [path.name for path in entries if _holds_tables(path)]
    if nested:
        return f"they seem to lie in {names(nested, 4)}: give one of these, or {wanted}"
    kinds = sorted({path.suffix for path in entries if path.suffix})
    if kinds:
        return f"there are only files of {', '.join(kinds)}; export them as CSV or Parquet"
    return wanted


def _holds_tables(path: Path) -> bool:
    if not path.is_dir() or not os.access(path, os.R_OK | os.X_OK):
        return False
    return any(inner.suffix.lower() in (".csv", ".parquet") for inner in path.iterdir())


def _spread(paths: Sequence[Path], wanted: int) -> list[Path]:
    """Return so many paths, evenly from the first to the last."""
    if len(paths) <= wanted:
        return list(paths)
    return [paths[round(i * (len(paths) - 1) / (wanted - 1))] for i in range(wanted)]


def _look_at_bags(paths: Sequence[Path], every: Sequence[Path], folder: Path) -> BagLook:
    try:
        return sniff_bags(paths, [path for path in every if path not in paths])
    except UnusableError as fault:
        raise OdisarError(f"{folder}: {fault}") from fault


def _look_at_tables(
    paths: Sequence[Path], every: Sequence[Path]
) -> tuple[tuple[Sample, ...], list[str]]:
    samples: list[Sample] = []
    unusable: dict[str, str] = {}
    others = [path for path in every if path not in paths]
    for path in (*paths, *others):
        if samples and path in others:  # these are only looked at where all before are unusable
            break
        try:
            sniff = sniff_parquet if format_of(path) == "parquet" else sniff_csv
            samples.append(sniff(path))
        except UnusableError as fault:
            unusable[path.name] = str(fault)
    if not samples:
        raise OdisarError(none_usable([(*item, "") for item in unusable.items()]))
    kinds = Counter(sample.signature for sample in samples)
    usual = max(kinds, key=lambda kind: kinds[kind])
    odd = [sample for sample in samples if sample.signature != usual and sample.layout is not None]
    kept = tuple(sample for sample in samples if sample not in odd)
    remarks = _unusable_remarks(unusable)
    remarks += [f"{item.path.name} is written otherwise: {_written(item)}" for item in odd]
    return kept, remarks


def _written(sample: Sample) -> str:
    layout = sample.layout
    told = [*sample.obstacles.values()]
    if layout is not None:
        told.append(f"separator {layout.separator}, decimal {layout.decimal}")
    return "; ".join(told)


def _unusable_remarks(unusable: Mapping[str, str]) -> list[str]:
    return [f"{name}: {reason}" for name, reason in unusable.items()]


def _common(
    samples: tuple[Sample, ...],
) -> tuple[tuple[Sample, ...], tuple[str, ...], list[str]]:
    """Return samples with the columns they share, and what was left out for that.

    Where all share less than half of what most have, the odd files are left out instead.
    """
    usual = Counter(frozenset(sample.columns) for sample in samples).most_common(1)[0][0]
    shared = frozenset.intersection(*(frozenset(sample.columns) for sample in samples))
    remarks: list[str] = []
    if len(shared) < max(2, len(usual) / 2):
        odd = [sample.path.name for sample in samples if not usual <= set(sample.columns)]
        samples = tuple(sample for sample in samples if usual <= set(sample.columns))
        remarks.append(f"{names(odd, 4)}: other columns than most files; not looked at further")
        shared = usual
    for name in dict.fromkeys(name for sample in samples for name in sample.columns):
        if name not in shared:
            having = [sample.path.name for sample in samples if name in sample.columns]
            remarks.append(f"column '{name}' is only in {names(having, 3)}: left out")
    columns = tuple(name for name in samples[0].columns if name in shared)
    return samples, columns, remarks


def _index_has_splits(path: Path) -> bool:
    try:
        header = path.read_text(encoding="utf-8-sig").splitlines()[0]
    except (OSError, UnicodeDecodeError, IndexError):
        return False
    return "split" in [name.strip() for name in header.split(",")]
