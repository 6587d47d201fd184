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


def faulty(*rows, group_by=("disturbance", "variant"), apart=(), with_clean=()):
    """Return cells by name of recordings given as (maneuver, variant, disturbance)."""
    groups = Groups(
        overall={}, group_by=list(group_by), apart=list(apart), with_clean=list(with_clean)
    )
    infos = [
        RecordingInfo("case", maneuver, variant, disturbance, "all", None)
        for maneuver, variant, disturbance in rows
    ]
    descriptions = [describe(info, groups) for info in infos]
    cells = disturbed_cells(descriptions, groups), clean_cells(descriptions, groups)
    names = [[cell.evaluated_on for cell in own] for own in cells]
    assert all(len(set(own)) == len(own) for own in names)
    return [{cell.evaluated_on: cell.members.tolist() for cell in own} for own in cells]


def test_a_value_of_two_columns_over_the_same_recordings_is_one_cell():
    disturbed, _ = faulty(("", "stuck", "stuck"), ("", "bias 1 sd", "bias"))
    assert disturbed == {"overall": [0, 1], "bias": [1], "stuck": [0], "bias 1 sd": [1]}


def test_a_value_of_two_columns_over_other_recordings_is_named_with_the_later_column():
    disturbed, _ = faulty(("", "stuck", "stuck"), ("", "slow", "stuck"))
    assert disturbed == {"overall": [0, 1], "stuck": [0, 1], "slow": [1], "stuck (variant)": [0]}


def test_what_is_apart_is_told_from_a_group_of_the_same_name():
    disturbed, _ = faulty(
        ("x", "", "noise"), ("", "", "x"), group_by=["maneuver"], apart=["disturbance"]
    )
    assert disturbed == {"overall": [0, 1], "x": [0], "noise": [0], "x (disturbance)": [1]}


def test_what_is_apart_and_judged_with_the_clean_is_no_group_without_them():
    disturbed, _ = faulty(
        ("x", "", "x"),
        ("", "", "none"),
        group_by=["maneuver"],
        apart=["disturbance"],
        with_clean=["x"],
    )
    assert disturbed == {"overall": [0], "x": [0], "x (disturbance)": [0, 1]}


def test_a_value_that_is_called_overall_is_not_taken_for_all_recordings():
    disturbed, clean = faulty(
        ("", "overall", "noise"), ("", "", "noise"), ("", "overall", "none"), ("", "", "none")
    )
    assert disturbed == {"overall": [0, 1], "noise": [0, 1], "overall (variant)": [0]}
    assert clean == {"overall": [2, 3], "overall (variant)": [2]}


def test_clean_cells_of_two_columns_are_one_or_told_apart():
    _, clean = faulty(
        ("a", "a", "none"), ("b", "b", "none"), ("a", "c", "none"), group_by=["maneuver", "variant"]
    )
    assert clean == {"overall": [0, 1, 2], "a": [0, 2], "b": [1], "a (variant)": [0], "c": [2]}


def test_a_group_has_one_name_among_the_disturbed_and_the_clean():
    disturbed, clean = faulty(
        ("a", "b", "noise"),
        ("b", "c", "noise"),
        ("c", "b", "none"),
        group_by=["maneuver", "variant"],
    )
    assert disturbed["b"] == [1]
    assert disturbed["b (variant)"] == [0]
    assert clean["b (variant)"] == [2]
    assert "b" not in clean
