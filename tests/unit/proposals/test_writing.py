"""A profile is put into params.yaml, and nothing else of the file changes."""

import pytest
from ruamel.yaml import YAML

from odisar.errors import OdisarError
from odisar.proposals.writing import check_name, write_profile
from odisar.proposals.yaml_text import limit, line, scalar

PROFILE = "  mine:                     # proposed\n    pipeline: {workers: 1}   # ? why\n"
HEAD = "# A file\nseed: 1   # odd  spacing\n\n"
BODY = "profiles:\n  smoke:          # small\n    seed: 2\n"


def written(tmp_path, text):
    path = tmp_path / "params.yaml"
    path.write_bytes(text.encode())
    write_profile(tmp_path, "mine", PROFILE)
    return path.read_bytes().decode()


def test_it_goes_to_the_end_of_the_profiles_at_the_end_of_the_file(tmp_path):
    assert written(tmp_path, HEAD + BODY) == HEAD + BODY + PROFILE


def test_or_before_the_section_that_follows_and_its_comment(tmp_path):
    after = "\n# About reports.\nreport:\n  title: x\n"
    assert written(tmp_path, HEAD + BODY + after) == HEAD + BODY + PROFILE + after


def test_a_file_without_a_last_line_end_gets_one(tmp_path):
    assert written(tmp_path, (HEAD + BODY).rstrip("\n")) == HEAD + BODY + PROFILE


def test_line_ends_of_windows_stay(tmp_path):
    text = (HEAD + BODY).replace("\n", "\r\n")
    assert written(tmp_path, text) == text + PROFILE.replace("\n", "\r\n")


@pytest.mark.parametrize(
    "text", [HEAD, HEAD + "profiles: {}\n", HEAD + "profiles: {a: {seed: 1}}\n"]
)
def test_a_file_without_such_a_block_is_left_alone(tmp_path, text):
    with pytest.raises(OdisarError, match="copy what is printed"):
        written(tmp_path, text)
    assert (tmp_path / "params.yaml").read_text() == text


def test_a_name_that_is_taken_is_refused_with_the_way_out(root):
    with pytest.raises(OdisarError, match=r"cases\.vessel is declared in params\.yaml: .*--name"):
        check_name(root, "vessel", write=False)
    with pytest.raises(OdisarError, match=r"profiles\.smoke is already in .*remove that section"):
        check_name(root, "smoke", write=True)
    check_name(root, "smoke", write=False)


@pytest.mark.parametrize(
    "value",
    ["v [m/s]", "y", "no", "1", "a: b", "x #1", "motor, left", "Über", 'quo"te', "", " lead",
     "null",
     "{a}", "- a", "°/s", "Roll (deg)", "100%", "*", "&a", "tab\there", 1.0e-5, 2.5e20, 3.0, True,
     None, 7],
)  # fmt: skip
def test_every_value_is_read_back_as_it_was(value):
    for text in (f"a: {scalar(value)}", f"{{a: {scalar(value)}, b: 1}}"):
        found = YAML(typ="safe").load(text)["a"]
        assert found == value
        assert type(found) is type(value)


@pytest.mark.parametrize(("value", "text"), [(-60.0, "-60"), (2.5, "2.5"), (1e12, "1.0e+12")])
def test_limits_are_written_short(value, text):
    assert limit(value) == text or YAML(typ="safe").load(limit(value)) == value


def test_doubts_stand_behind_a_line_marked():
    assert line(2, "a: 1", "", "unit unknown", "why").endswith("  # ? unit unknown; why")
    assert line(2, "a: 1", note="plain").endswith("  # plain")
    assert line(2, "a: 1", "") == "  a: 1"
