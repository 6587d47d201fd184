from importlib.util import find_spec

import numpy as np
import pytest

from odisar.baselines.registry import cheap_detectors, fit_existing, optional_detectors
from small_reference import (
    changed,
    drive_case,
    drive_reference,
    make_drive,
    reference_of,
    system_case,
    system_reference,
)


def test_a_case_without_a_pose_has_a_rate_of_change():
    names = ["mahalanobis", "pca-t2", "pca-spe", "rate-of-change", "stuck"]
    assert list(cheap_detectors(system_case())) == names


def test_a_case_with_a_relative_pose_has_velocities_to_hold_it_against():
    names = ["mahalanobis", "pca-t2", "pca-spe", "pose-velocity", "stuck"]
    assert list(cheap_detectors(drive_case())) == names


def test_the_study_adds_two():
    assert list(optional_detectors()) == ["isolation-forest", "ecod"]


def test_detectors_of_two_cases_are_never_the_same_object():
    first, second = cheap_detectors(system_case()), cheap_detectors(system_case())
    assert all(first[name] is not second[name] for name in first)


@pytest.mark.parametrize("make", [system_reference, drive_reference])
def test_those_that_exist_come_back_fitted_in_their_order(make):
    reference = make()
    detectors = cheap_detectors(reference.case)
    if find_spec("pyod") is not None:
        detectors |= optional_detectors()
    fitted = fit_existing(detectors, reference)
    assert list(fitted) == list(detectors)
    for detector in fitted.values():
        scores = detector.score(reference.held_out)
        assert all(np.isfinite(each).any() for each in scores)


def test_a_comparison_with_velocities_is_left_out_where_there_are_none():
    random = np.random.default_rng(4)
    train = []
    for i in range(3):
        drive = make_drive(f"train-{i}")
        values = drive.values.copy()
        values[:, 4:] = random.normal(size=(len(values), 3))
        train.append(changed(drive, values))
    reference = reference_of(drive_case(), train, train[:1])
    fitted = fit_existing(cheap_detectors(reference.case), reference)
    assert list(fitted) == ["mahalanobis", "pca-t2", "pca-spe", "stuck"]
