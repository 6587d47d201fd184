from odisar.artifacts import write_json
from odisar.config.loader import load_config
from odisar.report import tables

from .invented import ROOT, study


def test_parameters_show_the_tuned_value_of_the_only_member(results):
    table = tables.parameters(results, "vessel-all")
    assert table.columns[1:] == ["configured", "tuned", "published"]
    rows = {row[0]: row[1:] for row in table.rows}
    configured = f"{results.config.twin.layers}"
    assert rows["twin.layers"] == [configured, "2", "3"]
    assert rows["twin.dropout"][1] == "not tuned"
    assert not table.note


def test_parameters_show_the_range_over_folds(results, workspace):
    folds = {f"vessel-all.fold-{n}": study(2 + n) for n in range(4)}
    write_json(workspace.tuned("vessel-all"), {"members": folds})
    table = tables.parameters(results, "vessel-all")
    assert "2 to 5" in next(row for row in table.rows if row[0] == "twin.layers")
    assert "4 folds" in table.note


def test_the_profile_of_the_paper_is_what_the_report_calls_published():
    profile = load_config(ROOT).profiles["paper"]
    for name, value in tables.PUBLISHED_PARAMETERS.items():
        section, _, key = name.partition(".")
        assert profile[section][key] == value


def test_lead_times_of_a_narrowed_set_up_say_what_they_are_measured_against(results):
    assert all(not table.note for table in tables.scenario_tables(results, "vessel-all"))
    narrowed = tables.scenario_tables(results, "vessel-random")
    assert narrowed
    assert all("maneuver random only" in table.note for table in narrowed)
