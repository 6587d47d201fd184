"""params.yaml: complete, without unknown keys, and wrong in a way that says what to do."""

from pathlib import Path

import pytest
from ruamel.yaml import YAML

from odisar.config.loader import ConfigView, load_config, parse_config
from odisar.errors import OdisarError
from odisar.simulators import robot
from odisar.simulators.vessel.runs import CHANNELS
from odisar.sources import omni3
from odisar.sources.gunnerus import CHANNEL_NAMES
from odisar.workspaces import merge, merge_profile

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.fixture
def raw():
    return YAML(typ="safe", pure=True).load((ROOT / "params.yaml").read_text())


def test_the_file_is_valid_and_no_exponent_makes_a_number_text(raw):
    load_config(ROOT)

    def texts(value):
        if isinstance(value, dict):
            return [t for item in value.values() for t in texts(item)]
        if isinstance(value, list):
            return [t for item in value for t in texts(item)]
        return [value] if isinstance(value, str) else []

    def is_number(text):
        try:
            float(text)
        except ValueError:
            return False
        return not text.isdecimal()  # the unit "1" and the name of a session are meant as text

    assert [text for text in texts(raw) if is_number(text)] == []


@pytest.mark.parametrize("profile", ["smoke", "real", "paper"])
def test_every_profile_is_valid(raw, profile):
    merge_profile(raw, profile)


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        (("training", "epochs"), 0, "training.epochs"),
        (("training", "epoch"), 5, "training.epoch: Extra inputs"),
        (("twin", "heads"), 5, "must be a multiple of twin.heads=5"),
        (("twin", "patch_steps"), 7, "must be a multiple of twin.patch_steps=7"),
        (
            ("twin", "closed_form_lags"),
            21,
            "context_steps=20 is shorter than twin.closed_form_lags",
        ),
        (
            ("cases", "robot", "score", "shift", "memory_steps"),
            5,
            "memory_steps=5 is no longer than twin.closed_form_lags=5",
        ),
        (("pipeline", "setups"), ["nothing"], "'nothing' is not declared under setups"),
        (("setups", "vessel-all", "case"), "boat", "'boat' is not declared under cases"),
        (("cases", "vessel", "channels"), [], "cases.vessel.channels"),
        (("evaluation", "confidence"), 95, "evaluation.confidence"),
        (("seed",), "one", "seed"),
    ],
)
def test_a_wrong_value_is_named_with_its_key(raw, path, value, complaint):
    place = raw
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(OdisarError, match="nothing was run") as caught:
        parse_config(raw, "params.yaml")
    assert complaint in str(caught.value)


def test_every_complaint_is_listed_at_once(raw):
    raw["training"]["epochs"] = -1
    raw["twin"]["dropout"] = 2
    with pytest.raises(OdisarError, match="2 problem"):
        parse_config(raw, "params.yaml")


def test_a_stage_cannot_read_a_section_it_does_not_declare():
    view = ConfigView(load_config(ROOT), ("seed",))
    assert view.seed == load_config(ROOT).seed
    with pytest.raises(AttributeError, match="reads section 'twin'"):
        _ = view.twin


def test_a_profile_cannot_name_a_parameter_that_does_not_exist(raw):
    with pytest.raises(OdisarError, match="no such parameter"):
        merge(raw, {"training": {"epcohs": 1}}, "profiles.x")


@pytest.mark.parametrize("text", ["a: [", "- 1\n- 2\n"])
def test_a_file_that_is_no_mapping_is_refused(tmp_path, text):
    (tmp_path / "params.yaml").write_text(text)
    with pytest.raises(OdisarError, match=r"params\.yaml"):
        load_config(tmp_path)


def test_the_real_vessels_channels_are_those_of_its_conversion():
    config = load_config(ROOT)
    assert tuple(config.cases["gunnerus"].channel_names) == tuple(CHANNEL_NAMES)
    assert config.cases["gunnerus"].rate_hz == config.sources.gunnerus.rate_hz


def test_the_simulated_channels_are_those_of_their_simulators():
    cases = load_config(ROOT).cases
    assert tuple(cases["vessel"].channel_names) == tuple(CHANNELS)
    assert set(cases["robot"].channel_names) <= {*robot.CHANNELS, *robot.RANGE_CHANNELS}


def test_the_real_robots_channels_are_those_of_its_conversion():
    config = load_config(ROOT)
    assert tuple(config.cases["omni3"].channel_names) == tuple(omni3.CHANNEL_NAMES)
    assert config.cases["omni3"].rate_hz == config.sources.omni3.rate_hz
