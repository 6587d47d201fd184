import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.evaluation.tables import attribution_table, quadrant_table

from .evaluation_cases import CONFIG, GROUPS


def window(recording, category, states=("", "", ""), *, disturbed=False, strength=1.0):
    return {
        "setup": "ferry",
        "recording": recording,
        "base_seed": recording,
        "maneuver": "zigzag",
        "disturbance": "case-1" if strength else "none",
        "components": "all" if strength else "none",
        "strength": strength,
        "is_disturbed": disturbed,
        "category": category,
        **dict(zip(("state_1", "state_2", "state_3"), states, strict=True)),
    }


def assessed():
    return pd.DataFrame(
        [
            window("a", "green"),
            window("a", "green"),
            window("a", "orange", ("Roll Rate", "Yaw Rate", "Surge Speed"), disturbed=True),
            window("a", "yellow", disturbed=True),
            window("b", "green"),
            window("b", "red", ("Yaw Rate", "Sway Speed", "Roll Rate"), disturbed=True),
            window("b", "green", disturbed=True),
            window("b", "green"),
            window("c", "red", ("Roll Rate", "Yaw Rate", "Surge Speed"), strength=None),
        ]
    )


def test_quadrants_are_shares_of_the_windows_of_disturbed_recordings():
    table = quadrant_table(assessed(), GROUPS, CONFIG, 1, {"ferry": "vessel-all"})
    assert list(table["evaluated_on"].unique()) == ["overall", "case-1", "zigzag"]
    overall = table[table["evaluated_on"] == "overall"].set_index("quadrant")
    assert overall["share"].to_dict() == {
        "green": 5 / 8,
        "yellow": 1 / 8,
        "orange": 1 / 8,
        "red": 1 / 8,
    }
    assert overall["share_of_disturbed"].to_dict() == dict.fromkeys(overall.index, 0.25)
    assert overall.loc["green", "share_of_undisturbed"] == 1.0
    assert (overall["windows"] == 8).all()
    assert (overall["ci_low"] <= overall["share"]).all()
    assert (overall["share"] <= overall["ci_high"]).all()
    assert overall.loc["orange", ["published_low", "published_high"]].tolist() == [0.33, 0.39]
    assert pd.isna(overall.loc["yellow", "published_low"])


def test_published_quadrants_are_not_shown_below_full_strength():
    weak = assessed().assign(strength=0.25, disturbance="case-1", components="all")
    table = quadrant_table(weak, GROUPS, CONFIG, 1, {"ferry": "vessel-all"})
    assert table["published_low"].isna().all()
    assert (table["published"] == "").all()


def test_attribution_counts_first_places_and_places_among_three_in_flagged_windows():
    table = attribution_table(assessed(), GROUPS)
    overall = table[table["evaluated_on"] == "overall"].set_index("state")
    assert (overall["flagged_windows"] == 2).all()
    assert overall["top_1"].to_dict() == {
        "Roll Rate": 0.5,
        "Surge Speed": 0.0,
        "Sway Speed": 0.0,
        "Yaw Rate": 0.5,
    }
    assert overall["top_3"].to_dict() == {
        "Roll Rate": 1.0,
        "Surge Speed": 0.5,
        "Sway Speed": 0.5,
        "Yaw Rate": 1.0,
    }


def test_without_a_flagged_window_there_is_nothing_to_attribute():
    quiet = assessed().assign(category="green", state_1=None, state_2=None, state_3=None)
    assert attribution_table(quiet, GROUPS).empty


def test_a_missing_column_and_an_unknown_quadrant_are_named():
    with pytest.raises(OdisarError, match="lack the columns maneuver"):
        attribution_table(assessed().drop(columns="maneuver"), GROUPS)
    with pytest.raises(OdisarError, match="'blue' is none of"):
        attribution_table(assessed().assign(category="blue"), GROUPS)
