"""A deployed capability says, of a plain table, what the pipeline says of a recording."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace

import jsonschema
import pandas as pd
import pytest
import torch

from odisar.capability.assessment import assessment_schema
from odisar.deployment.bundle import read_bundle
from odisar.deployment.deployed import ASSESSMENT_COLUMNS
from odisar.deployment.samples import UNNAMED
from odisar.errors import OdisarError
from small_bundle import expected, pushed, small_case, table_of, write_small_bundle
from small_system import make_recording


def rows(assessments):
    return [asdict(assessment) for assessment in assessments]


def test_a_table_gets_exactly_the_assessments_of_the_pipeline(deployed, trained_twin):
    recording = pushed()
    said = deployed.assess(table_of(recording, named=True))
    assert said.to_dict("records") == rows(expected(trained_twin, recording))
    assert said["is_OOD"].any()
    assert not said["is_OOD"].all()


def test_the_columns_may_stand_in_any_order_and_hold_whole_numbers(deployed):
    table = table_of(make_recording("a"))
    whole = table.astype({"time_s": int, "Command": int})[list(reversed(table.columns))]
    pd.testing.assert_frame_equal(deployed.assess(whole), deployed.assess(table))


def test_a_table_without_names_is_one_recording(deployed):
    assert set(deployed.assess(table_of(make_recording("a")))["recording"]) == {UNNAMED}


def test_several_recordings_in_one_table_are_assessed_as_if_alone(deployed, trained_twin):
    one, two = pushed("one"), make_recording("two", 90)
    table = pd.concat([table_of(one, named=True), table_of(two, named=True)])
    wanted = rows(expected(trained_twin, one)) + rows(expected(trained_twin, two))
    assert deployed.assess(table).to_dict("records") == wanted


def test_no_window_crosses_a_gap(deployed, trained_twin):
    whole = make_recording("gap", 200)
    time_s = whole.time_s.copy()
    time_s[120:] += 30.0
    cut = replace(whole, time_s=time_s, segments=((0, 120), (120, 200)))
    wanted = rows(expected(trained_twin, cut))
    assert deployed.assess(table_of(cut, named=True)).to_dict("records") == wanted


def test_every_row_fits_the_published_schema(deployed):
    said = deployed.assess(table_of(pushed()))
    assert tuple(said.columns) == ASSESSMENT_COLUMNS
    validator = jsonschema.Draft202012Validator(assessment_schema())
    assert [row for row in said.to_dict("records") if not validator.is_valid(row)] == []


def test_the_example_is_accepted(deployed):
    assert len(deployed.assess(deployed.example)) == 2


def test_requests_at_the_same_time_do_not_disturb_each_other(deployed):
    tables = [table_of(pushed(f"p{i}", 150)) for i in range(6)]
    alone = [deployed.assess(table) for table in tables]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(deployed.assess, tables))
    for one, other in zip(alone, together, strict=True):
        pd.testing.assert_frame_equal(one, other)


def test_the_callers_threads_are_left_as_they_were(deployed):
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        deployed.assess(deployed.example)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


def test_a_table_that_cannot_be_assessed_is_refused(deployed):
    with pytest.raises(OdisarError, match="shorter than one window"):
        deployed.assess(deployed.example.iloc[:20])


def test_the_case_of_the_bundle_is_the_one_it_was_written_with(deployed):
    assert deployed.case == small_case()


def test_a_twin_in_relative_coordinates_is_deployed_with_its_pose(relative_twin, tmp_path):
    channels = [c.model_dump() | {"role": "state"} for c in small_case().channels]
    channels[0]["unit"] = "rad"
    heading = {"x": "Speed", "y": "Turn Rate", "heading": ["Command"], "coordinates": "relative"}
    channels[0]["output"] = False
    case = small_case(channels=channels, pose=heading)
    folder = write_small_bundle(tmp_path / "relative", relative_twin, case=case)
    recording = pushed()
    said = read_bundle(folder).assess(table_of(recording, named=True))
    assert said.to_dict("records") == rows(expected(relative_twin, recording))
    plain = write_small_bundle(
        tmp_path / "plain", relative_twin, case=small_case(channels=channels)
    )
    with pytest.raises(OdisarError, match="differ in pose"):
        read_bundle(plain)
