import pandas as pd

from odisar.report.ordering import ordered_values, size_key


def test_sizes_follow_their_number_and_not_their_text():
    assert sorted(["10 sd", "2 sd", "", "2 bar"], key=size_key) == ["", "2 bar", "2 sd", "10 sd"]


def test_sizes_of_one_kind_of_fault_stand_together():
    faults = [("delay", "1.2 s"), ("bias", "2 sd"), ("noise", "1 sd"), ("bias", "1 sd")]
    table = pd.DataFrame(faults, columns=["disturbance", "fault_size"])
    assert ordered_values(table, "fault_size") == ["1 sd", "2 sd", "1.2 s"]
    assert ordered_values(table, "disturbance") == ["bias", "delay", "noise"]
    assert ordered_values(table, "maneuver") == []
