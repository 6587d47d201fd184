from odisar.config.cases import Groups
from odisar.evaluation.cells import clean_cells, describe, disturbed_cells
from odisar.recordings.schema import RecordingInfo

from .evaluation_cases import GROUPS


def described(*rows, groups=GROUPS):
    infos = [RecordingInfo("vessel", m, "", d, c, s) for m, d, c, s in rows]
    return [describe(info, groups) for info in infos]


def by_name(cells):
    return {(cell.evaluated_on, cell.strength): cell.members.tolist() for cell in cells}


ROWS = described(
    ("zigzag", "case-1", "all", 0.5),
    ("zigzag", "case-1", "all", 1.0),
    ("random", "case-2", "all", 1.0),
    ("zigzag", "none", "none", None),
    ("random", "case-1", "wind", 0.5),
    ("random", "none", "none", None),
)


def test_strengths_are_never_pooled_and_apart_stays_apart():
    assert by_name(disturbed_cells(ROWS, GROUPS)) == {
        ("overall", 0.5): [0],
        ("overall", 1.0): [1, 2],
        ("case-1", 0.5): [0],
        ("case-1", 1.0): [1],
        ("case-2", 1.0): [2],
        ("random", 1.0): [2],
        ("zigzag", 0.5): [0],
        ("zigzag", 1.0): [1],
        ("wind", 0.5): [4],
    }


def test_clean_recordings_are_judged_by_maneuver_but_not_by_disturbance():
    assert by_name(clean_cells(ROWS, GROUPS)) == {
        ("overall", None): [3, 5],
        ("random", None): [5],
        ("zigzag", None): [3],
    }


def test_overall_narrows_clean_recordings_where_it_can():
    groups = Groups(
        overall={"maneuver": ["zigzag"], "components": ["all"]},
        group_by=[],
        apart=["maneuver"],
        with_clean=[],
    )
    rows = described(
        ("zigzag", "none", "none", None), ("random", "none", "none", None), groups=groups
    )
    assert by_name(clean_cells(rows, groups)) == {("overall", None): [0]}


def test_what_is_apart_obeys_overall_in_the_other_columns():
    groups = Groups(
        overall={"maneuver": ["zigzag"], "components": ["all"]},
        group_by=[],
        apart=["components"],
        with_clean=[],
    )
    rows = described(
        ("zigzag", "case-1", "wind", 0.5), ("random", "case-1", "wind", 0.5), groups=groups
    )
    assert by_name(disturbed_cells(rows, groups)) == {("wind", 0.5): [0]}


def test_recordings_without_a_strength_have_a_cell_of_their_own():
    groups = Groups(overall={}, group_by=[], apart=[], with_clean=[])
    rows = described(
        ("waypoint", "noise", "odometry", None),
        ("waypoint", "noise", "odometry", 1.0),
        groups=groups,
    )
    assert by_name(disturbed_cells(rows, groups)) == {("overall", None): [0], ("overall", 1.0): [1]}
