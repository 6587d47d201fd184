import numpy as np
import pandas as pd
import pytest
from PIL import Image

from odisar.artifacts import write_json
from odisar.config.loader import load_config
from odisar.report.clock import clock
from odisar.report.drawing import draw_figures
from odisar.report.figures.baselines import baselines_by_strength
from odisar.report.figures.events import fault_shares, forecast_examples
from odisar.report.figures.learning import tuning_trials
from odisar.report.figures.quadrants import quadrant_distribution
from odisar.report.figures.recordings import recordings_overview
from odisar.report.gallery import PLATES
from odisar.report.picking import drawn_scenarios, left_out_note
from odisar.report.style import QUADRANTS, channel_label, save_figure

from .altered import since_1970, with_faults, with_scenarios, without_disturbed
from .invented import CLEAN, DISTURBED, ROOT, study
from .invented_comparisons import write_study
from .layout import overlaps


def test_every_figure_that_applies_is_drawn_and_old_ones_go(results, tmp_path):
    folder = tmp_path / "figures"
    folder.mkdir()
    (folder / "of-a-set-up-that-is-gone.png").touch()
    drawn = draw_figures(results, folder)
    assert {item.path.name for item in drawn} == {path.name for path in folder.glob("*.png")}
    assert folder / "event-vessel-random.png" in {item.path for item in drawn}
    assert not any("fault" in item.path.name for item in drawn)


@pytest.fixture
def whole(results, workspace):
    """Results to which every figure applies: judged by scenario, on faults, and by the study."""
    write_study(workspace)
    with_scenarios(results)
    with_faults(results, "bias 1 sd", "noise 1 sd", "stuck")
    scores = results.scores("vessel-all")
    copies = set(results.examples.recordings.recording) - set(scores.recording)
    added = [scores[scores.recording == DISTURBED].assign(recording=name) for name in copies]
    for setup in results.setups:
        pd.concat([scores, *added]).to_parquet(workspace.scores(setup), index=False)
    faults = load_config(ROOT).cases["gunnerus"].faults
    case = results.case_of("vessel-all").model_copy(update={"faults": faults})
    results.case_of = lambda _setup: case
    return results


@pytest.mark.parametrize("plate", PLATES, ids=lambda plate: plate.name)
def test_no_panel_is_left_empty(whole, plate):
    subject = "vessel-all" if plate.scope == "setup" else "vessel"
    assert plate.applies(whole, subject)
    for axes in plate.draw(whole, subject).axes:
        assert axes.has_data() or axes.texts


@pytest.mark.parametrize("plate", PLATES, ids=lambda plate: plate.name)
def test_no_legend_title_or_label_lies_over_another(whole, plate):
    subject = "vessel-all" if plate.scope == "setup" else "vessel"
    assert overlaps(plate.draw(whole, subject)) == []


def test_tuning_trials_have_room_for_their_legend(results):
    assert overlaps(tuning_trials(results)) == []


def test_labels_that_lie_over_one_another_are_found(results):
    figure = recordings_overview(results, "vessel")
    figure.axes[0].set_ylabel("a name far longer than its panel is high, and unbroken")
    assert any("a name far longer" in pair for pair in overlaps(figure))


def test_long_channel_names_have_room(results):
    long = "imu_angular_velocity_of_the_base_x"
    traces = results.examples.traces
    traces.loc[traces.channel == "Yaw Rate", "channel"] = long
    case = results.config.cases["vessel"]
    channels = [item.model_copy(update={"name": long}) for item in case.channels]
    results.config.cases["vessel"] = case.model_copy(update={"channels": channels})
    assert overlaps(recordings_overview(results, "vessel")) == []


@pytest.mark.parametrize(
    ("name", "unit", "label"),
    [
        ("Surge Speed", "m/s", "Surge Speed\n[m/s]"),
        ("imu_angular_velocity_x", "rad/s", "imu_angular_\nvelocity_x\n[rad/s]"),
        ("Durchfluss [l/min]", "l/min", "Durchfluss\n[l/min]"),
        ("Druck (bar)", "bar", "Druck (bar)"),
        ("Ventil_Soll_%", "%", "Ventil_Soll_%"),
        ("pump_A", "A", "pump_A\n[A]"),
        ("Abgastemperaturmittelwert", "K", "Abgastemperatu\nrmittelwert\n[K]"),
    ],
)
def test_a_channel_is_labelled_in_short_lines_with_its_unit_once(name, unit, label):
    assert channel_label(name, unit) == label


def test_short_spans_are_told_in_seconds_and_long_ones_in_minutes():
    assert clock(100.0, 30.0).label == "time since start [s]"
    assert clock(100.0, 30.0).at(112.0) == pytest.approx(12.0)
    assert clock(100.0, 600.0).label == "time since start [min]"
    assert clock(100.0, 600.0).at(160.0) == pytest.approx(1.0)


def test_time_is_told_since_the_first_sample_of_the_recording(results):
    since_1970(results)
    first = recordings_overview(results, "vessel").axes[0]
    assert first.lines[0].get_xdata()[0] == 0.0
    assert first.patches[0].get_x() == pytest.approx(7.0)
    panel = forecast_examples(results, "vessel-all").axes[0]
    assert panel.get_title() == "issued at 600.0 s"
    assert panel.get_xlim()[1] == pytest.approx(660.0)


def test_strengths_are_drawn_only_where_there_are_any(results, tmp_path):
    for table in (results.detection, results.quadrants, results.attribution):
        table["strength"] = np.nan
    names = {item.path.stem for item in draw_figures(results, tmp_path / "figures")}
    assert "baselines-by-strength-vessel-all" not in names
    assert "protocols-vessel-all" in names
    # The notebook draws it for every set-up.
    assert baselines_by_strength(results, "vessel-all").axes[0].has_data()


def test_faults_are_told_by_kind_then_size(results, workspace):
    with_faults(results, "stuck", "delay 1.2 s", "bias 10 sd", "bias 2 sd")
    scores = results.scores("vessel-all")
    copies = set(results.examples.recordings.recording) - {CLEAN, DISTURBED}
    pd.concat([scores.assign(recording=name) for name in copies]).to_parquet(
        workspace.scores("vessel-all")
    )
    assert list(fault_shares(results, "vessel-all").index) == [
        "bias 2 sd",
        "bias 10 sd",
        "delay 1.2 s",
        "stuck",
    ]


def test_a_figure_is_the_same_bytes_twice_and_names_no_program(results, tmp_path):
    paths = [tmp_path / "one.png", tmp_path / "two.png"]
    for path in paths:
        save_figure(baselines_by_strength(results, "vessel-all"), path, "strengths")
    one, two = (path.read_bytes() for path in paths)
    assert one == two
    assert b"Software" not in one


def test_a_figure_has_a_palette_that_no_eye_tells_from_all_its_colours(results, tmp_path):
    path = tmp_path / "drawn.png"
    figure = baselines_by_strength(results, "vessel-all")
    save_figure(figure, path, "strengths")
    drawn = np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)
    with Image.open(path) as saved:
        assert saved.mode == "P"
        assert saved.info["dpi"] == pytest.approx((150, 150), abs=0.1)
        shown = np.asarray(saved.convert("RGB")).astype(int)
    below_the_title = shown[-len(drawn) :]
    assert below_the_title.shape == drawn.shape
    assert np.abs(below_the_title - drawn).max() <= 24


def test_bars_of_quadrants_are_stacked_to_all_windows(results):
    axes = quadrant_distribution(results, "vessel-all").axes[0]
    ends = [bar.get_x() + bar.get_width() for bar in axes.patches]
    assert len(ends) == len(QUADRANTS)
    assert max(ends) == pytest.approx(100)
    assert np.all(np.diff(ends) >= 0)


def test_every_figure_is_drawn_without_disturbed_recordings(results, tmp_path):
    without_disturbed(results)
    names = {item.path.stem for item in draw_figures(results, tmp_path / "figures")}
    assert "operating-point-vessel-all" in names
    assert "quadrants-vessel-all" not in names


def test_the_trials_of_every_fold_are_drawn_and_each_choice_is_ringed(results, workspace):
    folds = {f"vessel-all.fold-{n}": study(2 + n) for n in range(3)}
    write_json(workspace.tuned("vessel-all"), {"members": folds})
    complete, pruned, chosen = tuning_trials(results).axes[0].collections
    assert [len(part.get_offsets()) for part in (complete, pruned, chosen)] == [6, 3, 3]
    places = [x for part in (complete, pruned) for x in part.get_offsets()[:, 0]]
    assert len(set(places)) == len(places)
    assert all(x in places for x in chosen.get_offsets()[:, 0])
    assert {float(y) for y in chosen.get_offsets()[:, 1]} == {0.3}


def test_lead_times_of_a_narrowed_set_up_say_what_they_are_measured_against(results, tmp_path):
    drawn = draw_figures(results, tmp_path / "figures")
    noted = {item.path.stem for item in drawn if "maneuver random only" in item.caption}
    assert noted == {"operating-point-vessel-random"}


def test_the_finest_groups_are_left_to_the_tables_and_that_is_said(results):
    assert left_out_note(results, "vessel-all") == ""
    everything = pd.DataFrame(
        [("overall", "overall"), ("bias", "disturbance")]
        + [(f"bias {n}, Yaw Rate", "fault_on") for n in range(40)],
        columns=["evaluated_on", "group"],
    ).assign(is_apart=False)
    results.scenarios = lambda _setup: everything
    assert list(drawn_scenarios(results, "vessel-all").evaluated_on) == ["overall", "bias"]
    assert left_out_note(results, "vessel-all") == (
        "Not drawn, but in the tables: groups by fault_on."
    )


def test_a_scenario_that_shares_its_value_with_another_column_is_told_with_its_own(results):
    known = results.examples.recordings
    known["disturbance"] = known["maneuver"] = "storm"
    table = results.quadrants
    judged = table[table.setup == "vessel-all"]
    results.quadrants = pd.concat(
        [judged.assign(evaluated_on=name) for name in ("overall", "storm", "storm (maneuver)")]
    )
    scenarios = results.scenarios("vessel-all")
    assert dict(zip(scenarios.evaluated_on, scenarios.group, strict=True)) == {
        "overall": "overall",
        "storm": "disturbance",
        "storm (maneuver)": "maneuver",
    }
