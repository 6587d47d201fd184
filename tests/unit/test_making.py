"""Recordings are made where they are missing, made anew where their recipe changed, and tracked."""

import json
import shutil

import pytest
from ruamel.yaml import YAML

from odisar import making
from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.making import make_recordings, run_dvc, track_recordings
from odisar.recordings.recipe import check_recipe, recipe_file
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.simulators.vessel.runs import CHANNELS
from small_system import make_recording


@pytest.fixture
def workspace(tmp_path, request):
    """A folder that holds the shipped parameters and nothing else."""
    shutil.copyfile(request.config.rootpath / "params.yaml", tmp_path / "params.yaml")
    change(tmp_path, "pipeline", "setups", value=["vessel-all"])
    return tmp_path


@pytest.fixture
def simulated(monkeypatch):
    """Stand in for the simulator; return the seeds it was called with."""
    calls = []

    def sail(config, base_seed):
        calls.append(base_seed)
        for name in ("run-a", "run-b"):
            made = make_recording(name, 150)
            values = made.values.repeat(2, axis=1) + config.event.onset_s / 1000
            yield Recording(name, RecordingInfo("vessel", split="train"), made.time_s, values)

    monkeypatch.setattr(making, "simulate_vessel", sail)
    return calls


def change(workspace, *keys, value):
    """Put a value into the workspace's params.yaml."""
    yaml = YAML()
    path = workspace / "params.yaml"
    params = section = yaml.load(path.read_text(encoding="utf-8"))
    for key in keys[:-1]:
        section = section[key]
    section[keys[-1]] = value
    with path.open("w", encoding="utf-8") as file:
        yaml.dump(params, file)


def first_row(workspace):
    return (workspace / "data/vessel/run-a.csv").read_text(encoding="utf-8").splitlines()[1]


def test_missing_recordings_are_made_with_their_recipe(workspace, simulated):
    make_recordings(workspace)
    assert simulated == [load_config(workspace).simulators.seed]
    names = sorted(path.name for path in (workspace / "data/vessel").iterdir())
    assert names == ["labels.csv", "recordings.csv", "run-a.csv", "run-b.csv"]
    header = (workspace / "data/vessel/run-a.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.split(",") == ["time_s", *CHANNELS]
    check_recipe(workspace, "vessel", load_config(workspace).recipe_of("vessel"))


def test_recordings_of_the_same_recipe_are_left_as_they_are(workspace, simulated):
    make_recordings(workspace)
    mine = workspace / "data/vessel/run-a.csv"
    mine.write_text("touched by its owner\n")
    change(workspace, "training", "epochs", value=7)  # no parameter of the simulator
    make_recordings(workspace)
    assert mine.read_text() == "touched by its owner\n"
    assert len(simulated) == 1


def test_a_changed_simulator_makes_them_anew_and_removes_what_it_had_made(workspace, simulated):
    make_recordings(workspace)
    before = first_row(workspace)
    index = workspace / "data/vessel/recordings.csv"
    index.write_text(index.read_text() + "run-c,,,,,,,train,\n")
    for name in ("run-c", "not-listed"):
        (workspace / f"data/vessel/{name}.csv").write_text("time_s\n")
    change(workspace, "simulators", "vessel", "event", "onset_s", value=400.0)
    with pytest.raises(OdisarError, match="other values under `simulators`"):
        check_recipe(workspace, "vessel", load_config(workspace).recipe_of("vessel"))
    make_recordings(workspace)
    assert len(simulated) == 2
    assert first_row(workspace) != before
    assert not (workspace / "data/vessel/run-c.csv").exists()
    assert (workspace / "data/vessel/not-listed.csv").exists()
    check_recipe(workspace, "vessel", load_config(workspace).recipe_of("vessel"))


def test_recordings_of_unknown_origin_are_refused_and_kept(workspace, simulated):
    folder = workspace / "data/vessel"
    folder.mkdir(parents=True)
    (folder / "run-a.csv").write_text("time_s\n")
    with pytest.raises(OdisarError, match=r"data/vessel.*made-from\.json.*another source\.folder"):
        make_recordings(workspace)
    assert not simulated
    assert (folder / "run-a.csv").read_text() == "time_s\n"


def test_an_own_case_without_recordings_is_sent_to_the_readme(workspace, simulated):
    change(workspace, "cases", "vessel", "source", "maker", value="none")
    with pytest.raises(OdisarError, match=r"'vessel'.*data/vessel.*Your own recordings"):
        make_recordings(workspace)
    (workspace / "data/vessel").mkdir(parents=True)
    (workspace / "data/vessel/mine.csv").write_text("time_s\n")
    make_recordings(workspace)
    assert not simulated
    assert not recipe_file(workspace).exists()


def test_a_recipe_is_checked_by_case(tmp_path):
    with pytest.raises(OdisarError, match=r"'vessel'.*make data"):
        check_recipe(tmp_path, "vessel", "abc")
    recipe_file(tmp_path).parent.mkdir()
    recipe_file(tmp_path).write_text(json.dumps({"vessel": "abc"}))
    check_recipe(tmp_path, "vessel", "abc")
    for case, wanted in (("vessel", "abd"), ("tug", "abc")):
        with pytest.raises(OdisarError, match=f"{case!r}"):
            check_recipe(tmp_path, case, wanted)


@pytest.mark.usefixtures("simulated")
def test_only_recordings_that_are_known_or_accepted_pass(workspace, capsys):
    make_recordings(workspace)
    run_dvc(workspace, "init", "--no-scm", "--quiet")
    run_dvc(workspace, "config", "core.analytics", "false")
    track_recordings(workspace, accept=False)
    known = (workspace / "data.dvc").read_text()
    track_recordings(workspace, accept=False)
    assert (workspace / "data.dvc").read_text() == known

    changed = workspace / "data/vessel/run-a.csv"
    lines = changed.read_text().splitlines(keepends=True)
    changed.write_text("".join(lines[:-1]))
    with pytest.raises(OdisarError, match=r"make accept-data.*move data/ away"):
        track_recordings(workspace, accept=False)
    assert (workspace / "data.dvc").read_text() == known

    track_recordings(workspace, accept=True)
    assert "accepted" in capsys.readouterr().out
    assert (workspace / "data.dvc").read_text() != known
    track_recordings(workspace, accept=False)

    changed.write_text("".join([*lines[:5], lines[5].replace(",", ",abc", 1), *lines[6:-1]]))
    for accept in (False, True):
        with pytest.raises(OdisarError, match="cannot be used") as error:
            track_recordings(workspace, accept=accept)
        for part in ("data/vessel/run-a.csv", "6", CHANNELS[0], "abc"):
            assert part in str(error.value)
