"""Which recordings the shipped configuration makes."""

from collections import Counter

import pytest
from pydantic import ValidationError

from odisar.config.simulators import FleetConfig, LevelRange, VesselSimulatorConfig
from odisar.simulators.vessel.fleet import plan_fleet
from odisar.simulators.vessel.voyage import draw_voyage

COMPONENTS = ("wind", "waves", "current")


def test_the_shipped_fleet_has_the_planned_sizes(vessel):
    plans = plan_fleet(vessel)
    clean = Counter(p.split for p in plans if p.disturbance == "none")
    assert clean == {"train": 44, "validation": 22, "calibration": 53, "test": 22}
    disturbed = Counter((p.split, p.components) for p in plans if p.disturbance != "none")
    assert disturbed == {
        ("development", "all"): 132,
        ("development", "wind"): 11,
        ("development", "waves"): 11,
        ("development", "current"): 11,
        ("test", "all"): 132,
        ("test", "wind"): 11,
        ("test", "waves"): 11,
        ("test", "current"): 11,
    }


def test_names_are_unique(vessel):
    names = [plan.name for plan in plan_fleet(vessel)]
    assert len(set(names)) == len(names)
    assert {
        "train-random-low-2",
        "test-zigzag-10-case-1-s0.25",
        "test-turning-20-case-3-wind-s0.5",
        "development-turning-20-case-3-wind-s0.5",
        "test-zigzag-10-clean-1",
    } <= set(names)


def test_a_seed_is_shared_by_strengths_and_components_of_one_run_only(vessel):
    for plan in plan_fleet(vessel):
        stem = (
            plan.name if plan.disturbance == "none" else plan.name[: plan.name.index("case-") + 6]
        )
        assert plan.seed_name == stem


def test_development_has_components_apart_as_test_does_with_other_seeds(vessel):
    apart = {
        split: [p for p in plan_fleet(vessel) if p.split == split and p.components in COMPONENTS]
        for split in ("development", "test")
    }

    def what(plans):
        return [(p.maneuver, p.variant, p.disturbance, p.components, p.strength) for p in plans]

    assert what(apart["development"]) == what(apart["test"])
    seeds = [{plan.seed_name for plan in plans} for plans in apart.values()]
    assert len(seeds[0]) == len(seeds[1]) == 11
    assert not seeds[0] & seeds[1]


@pytest.mark.parametrize("kept", [(), ("test",), ("development",)])
def test_leaving_components_apart_out_changes_no_other_run(vessel, kept):
    every = plan_fleet(vessel)
    one_component = {split: vessel.fleet.one_component[split] for split in kept}
    fleet = vessel.fleet.model_copy(update={"one_component": one_component})
    fewer = plan_fleet(vessel.model_copy(update={"fleet": fleet}))
    assert fewer == [p for p in every if p.components not in COMPONENTS or p.split in kept]
    assert len(every) - len(fewer) == 33 * (2 - len(kept))


def test_other_splits_have_no_components_apart(vessel):
    fields = vessel.fleet.model_dump()
    fields["one_component"]["calibration"] = fields["one_component"]["test"]
    with pytest.raises(ValidationError, match="one_component"):
        FleetConfig.model_validate(fields)


def test_random_only_calibration_has_more_than_six_hours(vessel):
    random = [p for p in plan_fleet(vessel) if (p.split, p.maneuver) == ("calibration", "random")]
    assert len(random) * vessel.duration_s > 6 * 3600


def test_development_and_test_start_on_other_headings(vessel):
    sector = vessel.fleet.heading_sector_deg
    for plan in plan_fleet(vessel):
        heading = draw_voyage(plan, vessel, 3).heading_deg
        assert 0.0 <= heading < 360.0
        if plan.split in ("test", "development"):
            assert int(heading // sector) % 2 == (plan.split == "development")


def test_a_full_level_at_the_edge_of_normal_weather_is_refused():
    with pytest.raises(ValidationError, match="would be normal weather"):
        LevelRange(low=2.0, edge=8.0, full=8.0)


def test_an_odd_number_of_heading_sectors_is_refused(vessel):
    fields = vessel.fleet.model_dump() | {"heading_sector_deg": 40.0}
    with pytest.raises(ValidationError, match="even number of sectors"):
        FleetConfig.model_validate(fields)


def test_an_event_that_outlasts_the_recording_is_refused(vessel):
    fields = vessel.model_dump() | {"duration_s": 880}
    with pytest.raises(ValidationError, match="lies after duration_s=880"):
        VesselSimulatorConfig.model_validate(fields)
