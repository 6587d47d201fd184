"""Whether the guilty channel is named, counted by hand."""

import numpy as np
import pandas as pd
import pytest

from odisar.evaluation.blame import ANY, ATTRIBUTIONS, BLAME_COLUMNS, blame_table, named_by_chance

from .evaluation_cases import CONFIG

NOBODY = ("", "", "")


def window(guilty, named, rebuilt=NOBODY, **changes):
    """Return the row of an assessed window."""
    row = {
        "setup": "s",
        "recording": "a",
        "base_seed": "a",
        "fault": "bias",
        "guilty": guilty,
        "is_disturbed": True,
        "state_chance": 1 / 4,
        "rebuilt_state_chance": 1 / 2,
    }
    for prefix, names in (("state", named), ("rebuilt_state", rebuilt)):
        row |= {f"{prefix}_{i}": name for i, name in enumerate(names, start=1)}
    return row | changes


def table_of(*rows):
    return blame_table(pd.DataFrame(rows), CONFIG, 7)


def cell(table, attribution="odisar", fault=ANY, guilty=ANY):
    """Return the one row of a cell."""
    found = table[
        (table.attribution == attribution) & (table.fault == fault) & (table.guilty == guilty)
    ]
    assert len(found) == 1
    return found.iloc[0]


def in_b(*args, **changes):
    return window(*args, **{"recording": "b", "base_seed": "b"} | changes)


def test_hits_are_counted_first_and_among_three():
    table = table_of(
        window("u", ("u", "v", "r")),
        window("u", ("v", "r", "u")),
        in_b("u", ("v", "r", "p")),
        in_b("u", ("v", "u", "p")),
    )
    assert tuple(table.columns) == BLAME_COLUMNS
    row = cell(table)
    assert (row.windows, row.recordings) == (4, 2)
    assert row.hit_1 == pytest.approx(1 / 4)
    assert row.hit_3 == pytest.approx(3 / 4)


@pytest.mark.parametrize(("guilty", "hit"), [("oz", 1), ("ow", 1), ("o", 0), ("oz / ow", 0)])
def test_a_headings_channels_are_named_together(guilty, hit):
    row = cell(table_of(window(guilty, ("oz / ow", "u", "v"))))
    assert row.hit_1 == row.hit_3 == hit


def test_a_name_that_only_holds_the_channels_is_no_hit():
    assert cell(table_of(window("u", ("u2", "gust", "v")))).hit_3 == 0


def test_only_flagged_windows_inside_of_a_known_fault_count():
    table = table_of(
        window("u", ("u", "v", "r")),
        window("u", ("v", "r", "p"), is_disturbed=False),
        window("u", NOBODY, ("v", "", "")),
        window("", ("v", "r", "p")),
    )
    assert (cell(table).windows, cell(table).hit_1) == (1, 1)
    rebuilt = cell(table, "reconstruction")
    assert (rebuilt.windows, rebuilt.hit_1) == (1, 0)


def test_each_attribution_is_judged_by_its_own_names():
    table = table_of(window("u", ("u", "v", "r"), ("v", "u", "")))
    assert set(table.attribution) == set(ATTRIBUTIONS)
    assert (cell(table).hit_1, cell(table).hit_3) == (1, 1)
    rebuilt = cell(table, "reconstruction")
    assert (rebuilt.hit_1, rebuilt.hit_3) == (0, 1)


def test_chance_is_that_of_naming_at_random():
    table = table_of(
        window("u", ("u", "v", "r"), ("u", "v", "")),
        window("u", ("v", "r", "u"), ("u", "v", ""), state_chance=1 / 10),
    )
    row, rebuilt = cell(table), cell(table, "reconstruction")
    assert row.chance_1 == pytest.approx((1 / 4 + 1 / 10) / 2)
    assert row.chance_3 == pytest.approx((3 / 4 + 3 / 10) / 2)
    assert (rebuilt.chance_1, rebuilt.chance_3) == (1 / 2, 1)


def test_there_is_a_row_for_all_for_each_fault_and_for_each_of_its_channels():
    table = table_of(
        window("v", ("u", "r", "p")),
        window("u", ("u", "v", "r")),
        in_b("u", ("v", "r", "p"), fault="noise"),
        in_b("u", ("u", "r", "p"), setup="t"),
    )
    own = table[(table.setup == "s") & (table.attribution == "odisar")]
    assert list(zip(own.fault, own.guilty, own.windows, own.hit_1, strict=True)) == [
        (ANY, ANY, 3, pytest.approx(1 / 3)),
        ("bias", ANY, 2, 0.5),
        ("bias", "u", 1, 1),
        ("bias", "v", 1, 0),
        ("noise", ANY, 1, 0),
        ("noise", "u", 1, 0),
    ]
    other = table[table.setup == "t"]
    assert other.fault.tolist() == [ANY, "bias", "bias"]


def bounds(row, top):
    return row[[f"hit_{top}_low", f"hit_{top}_high"]].to_numpy(dtype=float)


@pytest.mark.parametrize("recording", ["a", "c"])
def test_recordings_that_vary_together_give_no_interval_alone(recording):
    row = cell(
        table_of(
            window("u", ("u", "v", "r")),
            window("u", ("v", "r", "u"), recording=recording),
        )
    )
    assert np.isnan(np.concatenate([bounds(row, 1), bounds(row, 3)])).all()
    assert row.hit_1 == 0.5


def test_an_interval_is_as_wide_as_recordings_differ():
    row = cell(
        table_of(
            *[window("u", ("u", "v", "r"))] * 3,
            *[in_b("u", ("v", "r", "u"))] * 3,
        )
    )
    np.testing.assert_array_equal(bounds(row, 1), [0, 1])
    np.testing.assert_array_equal(bounds(row, 3), [1, 1])


def test_intervals_do_not_hang_on_the_order_of_rows():
    rows = [window("u", ("u", "v", "r")), in_b("u", ("v", "r", "u")), in_b("u", ("u", "v", "r"))]
    rows += [window("u", ("v", "r", "p"), recording="c", base_seed="c")]
    pd.testing.assert_series_equal(cell(table_of(*rows)), cell(table_of(*rows[::-1])))


def test_nothing_to_judge_leaves_an_empty_table_with_its_columns():
    table = table_of(window("", ("u", "v", "r")))
    assert table.empty
    assert tuple(table.columns) == BLAME_COLUMNS


def test_who_can_not_be_named_is_named_by_no_chance():
    assert named_by_chance("u", ["u", "v"]) == 1 / 2
    assert named_by_chance("oz", ["x", "y", "oz / ow"]) == pytest.approx(1 / 3)
    assert named_by_chance("u", ["x", "y"]) == 0.0
