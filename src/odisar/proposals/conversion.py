"""What to run first where recordings can be understood but not read: a short Python program."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from odisar.errors import OdisarError
from odisar.proposals.dates import WHOLE_SECOND, DateFormat
from odisar.proposals.samples import Sample
from odisar.proposals.times import TimeColumn


def require_readable(samples: Sequence[Sample], time: TimeColumn, folder: Path) -> None:
    """Raise OdisarError where the pipeline can't read such files, with a program that mends them.

    The files themselves stay as they are: copies are written into another folder.
    """
    sample = samples[0]
    reasons = [f"{sample.path.name}: {obstacle}" for obstacle in sample.obstacles.values()]
    question = ""
    if time.dates is not None:
        reasons.append(
            f"{sample.path.name}: column '{time.name}' holds dates as text "
            f"({time.dates.example}), {_reading(time.dates)}; time must be a number of seconds"
        )
        question = _question(time.dates)
    elif not time.is_readable:
        reasons.append(
            f"{sample.path.name}: column '{time.name}' counts {time.unit_name}; time must be in "
            "seconds"
        )
    if not reasons:
        return
    target = folder.with_name(f"{folder.name}-converted")
    raise OdisarError(
        "the recordings can be understood, but not read as they are:\n  "
        + "\n  ".join(reasons)
        + question
        + f"\n\nThis writes copies that can be read into {target}:\n\n"
        + program(sample, time, folder, target)
        + f"\nThen: odisar new-case {quoted(target)}"
    )


def _reading(dates: DateFormat) -> str:
    """Say how dates are read."""
    form = dates.formats[0]
    if dates.is_ambiguous:
        return f"which is ambiguous: {' or '.join(map(dates.meaning, dates.formats))}"
    if "%d" not in form:
        return f"read as {form}"
    order = "day" if form.index("%d") < form.index("%m") else "month"
    order = "year" if form.startswith("%Y") else order
    return f"read as {form}, the {order} first: {dates.meaning(form)}"


def _question(dates: DateFormat) -> str:
    if not dates.is_ambiguous:
        return ""
    return (
        "\n\nDoes the day or the month stand first? No day in the files is above 12, so nothing "
        "tells. Take the # away\nbefore one of the two lines `date_format` in the program below; "
        "as it stands it writes nothing."
    )


def _date_lines(dates: DateFormat, name: str) -> list[str]:
    """Return the lines that read a column of dates as ``clock``."""
    text = f'table.pop({name}).astype("string").str.strip()'
    if dates.fraction:
        text += f'.str.replace(r"{WHOLE_SECOND}", r"\1{dates.fraction}0", regex=True)'
    lines = [
        f"    text = {text}",
        "    clock = pd.to_datetime(text, format=date_format, utc=True)",
    ]
    if dates.is_time_of_day:
        lines += [
            '    midnights = (clock.diff() < pd.Timedelta("-12h")).cumsum()',
            '    clock = clock + pd.to_timedelta(midnights, unit="D")',
        ]
    return [*lines, '    table.insert(0, "time_s", (clock - clock.iloc[0]).dt.total_seconds())']


def _format_lines(dates: DateFormat) -> list[str]:
    """Return the line that says how dates are written; where that is open, one for each way."""
    if not dates.is_ambiguous:
        return [f"date_format = {json.dumps(dates.formats[0])}"]
    return [
        f"# date_format = {json.dumps(form)}  # {dates.example} is {dates.meaning(form)}"
        for form in dates.formats
    ]


def quoted(path: Path) -> str:
    """Return a path as a shell takes it."""
    text = str(path)
    return text if all(sign.isalnum() or sign in "/._-~" for sign in text) else f"'{text}'"


def program(sample: Sample, time: TimeColumn, folder: Path, target: Path) -> str:
    """Return a shell command that converts every file of a folder."""
    is_csv = sample.layout is not None
    suffix = "csv" if is_csv else "parquet"
    read = f"pd.read_csv(path{_options(sample)})" if is_csv else "pd.read_parquet(path)"
    name = json.dumps(time.name, ensure_ascii=False)
    lines = [
        f"{quoted(Path(sys.executable))} - <<'END'",
        "import pathlib, pandas as pd",
        *(_format_lines(time.dates) if time.dates else ()),
        f"target = pathlib.Path({json.dumps(str(target), ensure_ascii=False)})",
        "target.mkdir(exist_ok=True)",
        f"folder = pathlib.Path({json.dumps(str(folder), ensure_ascii=False)})",
        f'for path in sorted(folder.glob("*.{suffix}")):',
        f"    table = {read}",
    ]
    if time.dates is not None:
        lines += _date_lines(time.dates, name)
    elif not time.is_readable:
        lines += [
            f"    clock = table.pop({name})",
            f'    table.insert(0, "time_s", (clock - clock.iloc[0]) * {time.scale_s:g})',
        ]
    if sample.units and is_csv:
        lines.append(f"    table = table.rename(columns={_with_units(sample, time)})")
    lines += [f"    table.to_{suffix}(target / path.name, index=False)", "END", ""]
    return "\n".join(lines)


def _with_units(sample: Sample, time: TimeColumn) -> str:
    """Return the new names of columns: with the units that stood below them."""
    new = {
        name: f"{name} [{unit}]"
        for name, unit in sample.units.items()
        if name != time.name and any(sign.isalnum() or sign in "%°" for sign in unit)
    }
    return json.dumps(new, ensure_ascii=False)


def _options(sample: Sample) -> str:
    """Return what pandas must know to read a file, as arguments."""
    layout = sample.layout
    if layout is None:
        return ""
    options = []
    if layout.separator == "space":
        options.append('sep=r"\\s+"')
    elif layout.separator != "comma":
        options.append(f"sep={json.dumps(layout.separator_sign)}")
    if layout.decimal == "comma":
        options.append('decimal=","')
    if sample.encoding != "utf-8-sig":
        options.append(f'encoding="{sample.encoding}"')
    skipped = [*range(sample.header_line)]
    skipped += [sample.header_line + 1] if sample.units else []
    if skipped:
        options.append(f"skiprows={skipped}")
    return "".join(f", {option}" for option in options)
