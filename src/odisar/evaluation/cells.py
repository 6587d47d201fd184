"""Cells: which recordings each row of a table pools."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.evaluation.intervals import Resampler
from odisar.recordings.schema import UNDISTURBED, RecordingInfo
from odisar.seeding import generator

#: The row over all recordings that ``Groups.overall`` selects.
OVERALL = "overall"

#: Metadata of one recording, by column, as text.
Description = Mapping[str, str]


@dataclass(frozen=True)
class Cell:
    """Recordings judged together; ``members`` are their positions in the list they came from."""

    evaluated_on: str
    strength: float | None
    members: NDArray[np.intp]

    @property
    def strength_or_nan(self) -> float:
        """The strength as a table holds it: empty where the recordings have none."""
        return float("nan") if self.strength is None else self.strength


def metadata_columns(groups: Groups) -> list[str]:
    """Return the columns that the grouping looks at."""
    names = ["disturbance", "strength", *groups.overall, *groups.group_by, *groups.apart]
    return list(dict.fromkeys(names))


def describe(info: RecordingInfo, groups: Groups) -> Description:
    """Return a recording's metadata as far as the grouping looks at it."""
    return {name: info.column(name) for name in metadata_columns(groups)}


def is_disturbed(description: Description) -> bool:
    """Whether a described recording holds a disturbance."""
    return description["disturbance"] != UNDISTURBED


def disturbed_cells(descriptions: Sequence[Description], groups: Groups) -> list[Cell]:
    """Return the cells over disturbed recordings: overall, by group, and apart.

    Strengths are never pooled: every cell exists once for each strength among its recordings. The
    recordings ``apart`` obey ``overall`` in every column but the one that sets them apart, as far
    as they have a value there.

    A group is named by its value. Where two columns share a value over the same recordings they
    are one group; over others the later group is named "value (column)" (see ``cell_name``).
    """
    names = _group_names(descriptions, groups)
    disturbed = [i for i, d in enumerate(descriptions) if is_disturbed(d)]
    clean = [i for i, d in enumerate(descriptions) if not is_disturbed(d)]
    overall = [i for i in disturbed if _is_overall(descriptions[i], groups)]
    pools = {OVERALL: overall}
    for column in groups.group_by:
        for value in _values(descriptions, column):
            chosen = [i for i in overall if descriptions[i][column] == value]
            _pool(pools, (names[column, value], cell_name(column, value)), chosen)
    for column in groups.apart:
        alike = [
            i for i in disturbed if _is_overall(descriptions[i], groups, but=column, passing=("",))
        ]
        for value in _values(descriptions, column):
            if value not in groups.overall.get(column, []):
                chosen = [i for i in alike if descriptions[i][column] == value]
                chosen += clean if value in groups.with_clean else []
                _pool(pools, (names[column, value], cell_name(column, value)), chosen)
    return [cell for name, chosen in pools.items() for cell in _split(descriptions, name, chosen)]


def clean_cells(descriptions: Sequence[Description], groups: Groups) -> list[Cell]:
    """Return the cells over undisturbed recordings: overall, and by group where they differ.

    ``overall`` narrows them too, but not by columns that say what disturbs (which is nothing).
    Groups are named as in ``disturbed_cells``.
    """
    names = _group_names(descriptions, groups)
    clean = [
        i
        for i, d in enumerate(descriptions)
        if not is_disturbed(d) and _is_overall(d, groups, passing=("", UNDISTURBED))
    ]
    pools = {OVERALL: clean}
    for column in groups.group_by:
        for value in _values(descriptions, column):
            chosen = [i for i in clean if descriptions[i][column] == value]
            _pool(pools, (names[column, value], cell_name(column, value)), chosen)
    return [Cell(name, None, np.array(members)) for name, members in pools.items() if members]


def cell_name(column: str, value: str) -> str:
    """Return the name of a group whose value alone is the name of another group."""
    return f"{value} ({column})"


def _group_names(descriptions: Sequence[Description], groups: Groups) -> dict[tuple[str, str], str]:
    """Return the name of each group by column and value.

    It follows from all recordings, disturbed or not: a group has one name in every table.
    """
    names: dict[tuple[str, str], str] = {}
    named: dict[str, list[int]] = {OVERALL: []}
    for column in dict.fromkeys([*groups.group_by, *groups.apart]):
        for value in _values(descriptions, column):
            members = [i for i, d in enumerate(descriptions) if d[column] == value]
            is_free = named.setdefault(value, members) == members
            names[column, value] = value if is_free else cell_name(column, value)
    return names


def _pool(pools: dict[str, list[int]], names: tuple[str, str], chosen: list[int]) -> None:
    """Add a group, if it has recordings, under the first name that no other recordings have.

    One name can still stand for two pools where one of them is judged with the clean recordings.
    """
    if chosen:
        first, second = names
        pools[first if pools.get(first, chosen) == chosen else second] = chosen


def _is_overall(
    description: Description,
    groups: Groups,
    but: str | None = None,
    passing: tuple[str, ...] = (),
) -> bool:
    return all(
        description[column] in allowed or description[column] in passing
        for column, allowed in groups.overall.items()
        if column != but
    )


def _values(descriptions: Sequence[Description], column: str) -> list[str]:
    return sorted({d[column] for d in descriptions} - {"", UNDISTURBED})


def _split(
    descriptions: Sequence[Description], evaluated_on: str, chosen: Sequence[int]
) -> list[Cell]:
    """Return one cell for each strength among the chosen recordings, those without one first."""
    by_strength: dict[float | None, list[int]] = {}
    for i in chosen:
        text = descriptions[i]["strength"]
        by_strength.setdefault(float(text) if text else None, []).append(i)
    strengths = sorted(by_strength, key=lambda value: -np.inf if value is None else value)
    return [Cell(evaluated_on, value, np.array(by_strength[value])) for value in strengths]


def cell_resampler(cell: Cell, clusters: Sequence[str], cfg: Judging, base_seed: int) -> Resampler:
    """Draw the bootstrap weights of a cell; ``clusters`` are those of its members.

    The seed's name leaves out set-up, protocol and detector: they are compared on the same draws.
    """
    rng = generator(base_seed, "evaluation", cell.evaluated_on, str(cell.strength))
    return Resampler.draw(clusters, cfg.bootstrap_draws, cfg.confidence, rng)
