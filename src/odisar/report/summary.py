"""The summary: sentences whose numbers, and whose presence, follow from the result tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from odisar.report.failings import failings
from odisar.report.load import Results
from odisar.report.picking import MONITOR, at_strength, percent, pick, selection
from odisar.report.style import METRIC_NAMES, ORACLE


@dataclass(frozen=True)
class Summary:
    """Sentences by topic; those that differ between set-ups by set-up's heading."""

    lead: Sequence[str]
    found: Mapping[str, Sequence[str]]
    certainty: Sequence[str]
    failings: Mapping[str, Sequence[str]]
    reading: Sequence[str]


def summarise(results: Results) -> Summary:
    """Return the summary of a workspace's results."""
    titles = {setup: setup_title(results, setup) for setup in results.setups}
    return Summary(
        lead=[_lead(results, case) for case in results.cases],
        found={title: _found(results, setup) for setup, title in titles.items()},
        certainty=_certainty(results),
        failings={title: failings(results, setup) for setup, title in titles.items()},
        reading=_reading(results),
    )


def setup_title(results: Results, setup: str) -> str:
    """Return a set-up's name and what its twin was trained on."""
    kept = selection(results, setup)
    return f"{setup} (trained on {kept} only)" if kept else setup


def _lead(results: Results, case: str) -> str:
    """Return what was done with a case, in one sentence or two."""
    given = results.config.cases[case]
    context_s = given.window.context_steps / given.rate_hz
    horizon_s = given.window.horizon_steps / given.rate_hz
    setup = results.setups_of(case)[0]
    known = results.examples.recordings
    known = known[known.setup == setup]
    noun = "blocks" if given.splits.kind == "cross-fit" else "recordings"
    return (
        f"{given.title}: a twin trained on undisturbed recordings looks at the last "
        f"{context_s:g} s, forecasts the next {horizon_s:g} s, and reconstructs its own forecast. "
        "Where the reconstruction fails, the machine is taken to be out of distribution. It was "
        f"tested on {_tested_on(known, noun)}, none of which the twin at test had seen."
    )


def _tested_on(known: pd.DataFrame, noun: str) -> str:
    """Return what a twin was tested on; copies with an injected fault are called that."""
    copies = known[known.is_disturbed & (known.fault_channel != "")]
    disturbed = int(known.is_disturbed.sum()) - len(copies)
    clean = list(known[~known.is_disturbed].recording)
    if copies.empty:
        return f"{disturbed} disturbed and {len(clean)} undisturbed recordings"
    # A copy is called by its original's name and its fault.
    copied = {name for name in clean if copies.recording.str.startswith(f"{name}-").any()}
    parts = [f"{len(copies)} copies of {len(copied)} undisturbed {noun} with injected faults"]
    if disturbed:
        parts.insert(0, f"{disturbed} disturbed {noun}")
    if len(copied) == len(clean):
        parts.append(f"the {len(clean)} themselves")
    else:
        parts.append(f"all {len(clean)} undisturbed {noun}")
    return f"{', '.join(parts[:-1])}, and on {parts[-1]}"


def _found(results: Results, setup: str) -> list[str]:
    """Return what the monitor achieves at the greatest and at the least strength."""
    strengths = results.strengths(setup)
    sentences = []
    for strength in dict.fromkeys((strengths[-1], strengths[0])):
        parts = []
        for metric in ("auroc", "tnr_at_tpr95", "f1_ood"):
            value = pick(results, setup, MONITOR, metric, strength)
            if value is not None:
                parts.append(f"{METRIC_NAMES[metric]} {percent(value)}")
        if parts:
            place = at_strength(strength) or "overall"
            sentences.append(f"{place.capitalize()}: {', '.join(parts)} under protocol P2.")
    return sentences + _alarms(results, setup)


def _alarms(results: Results, setup: str) -> list[str]:
    detected = pick(results, setup, MONITOR, "events_detected")
    if detected is None:
        return []
    delay = pick(results, setup, MONITOR, "delay_p50_s")
    soon = "" if delay is None else f", half of them within {delay.value:.0f} s of their onset"
    rate = pick(results, setup, MONITOR, "false_alarms_per_hour")
    price = "" if rate is None else f", at {rate.value:.2f} false alarms per hour"
    where = at_strength(results.strengths(setup)[-1]) or "overall"
    return [f"{where.capitalize()}, alarms found {percent(detected)} of the events{soon}{price}."]


def _certainty(results: Results) -> list[str]:
    evaluation = results.config.evaluation
    calibration, few = [], []
    for setup in results.setups:
        hours = [limit["operating_hours"] for limit in results.limits(setup).values()]
        calibration.append(f"{_range(hours)} h ({setup})")
        if min(hours) < evaluation.operating_point.pool_below_hours:
            few.append(setup)
    undisturbed = results.operating.groupby("setup").hours.max()
    tested = [f"{undisturbed.get(setup, 0.0):.1f} h ({setup})" for setup in results.setups]
    sentences = [
        (
            f"Brackets are {100 * evaluation.confidence:g} % intervals from "
            f"{evaluation.bootstrap_draws} bootstrap draws over test recordings; recordings that "
            "share a base seed are drawn together. False alarms have exact Poisson intervals."
        ),
        (
            "There is one training seed: the intervals do not hold how much the numbers would "
            "change with another training."
        ),
        (
            f"Alarm thresholds rest on {', '.join(calibration)} of calibration recordings. False "
            f"alarms were counted in {', '.join(tested)} of undisturbed test recordings."
        ),
    ]
    if few:
        sentences.append(
            f"Fewer than {evaluation.operating_point.pool_below_hours:g} h of calibration "
            f"({', '.join(few)}): the alarm threshold itself is uncertain, and so is the rate of "
            "false alarms elsewhere."
        )
    return sentences + _pooling(results)


def _pooling(results: Results) -> list[str]:
    """Say what an alarm threshold pooled over folds rests on."""
    pooled = [
        setup
        for setup in results.setups
        if any(limit["operating_pooled"] == 1 for limit in results.limits(setup).values())
    ]
    if not pooled:
        return []
    return [
        (
            f"The alarm threshold of a fold ({', '.join(pooled)}) pools the scores of its own "
            "calibration blocks with out-of-fold scores of the other folds' calibration blocks. "
            "None of these is one of the fold's test blocks, but the other folds' twins may have "
            "trained on its test blocks."
        )
    ]


def _range(values: Sequence[float]) -> str:
    low, high = f"{min(values):.1f}", f"{max(values):.1f}"
    return low if low == high else f"{low} to {high}"


def _reading(results: Results) -> list[str]:
    sentences = [
        (
            "A score at time t uses samples up to t and the thresholds of calibration recordings. "
            "No twin was trained, tuned or calibrated on a recording that tests it."
        ),
        (
            "P2 asks the monitor's question: is a disturbance active now, given what is known now? "
            "P1 is the paper's protocol: a window's score stands for every step of its horizon."
        ),
    ]
    for setup in results.setups:
        auroc = pick(results, setup, ORACLE, "auroc", protocol="P1")
        tnr = pick(results, setup, ORACLE, "tnr_at_tpr95", protocol="P1")
        if auroc is None or tnr is None:
            continue
        sentences.append(
            f"{setup}: under P1 an oracle that knows whether a disturbance is active when the "
            f"forecast is issued reaches AUROC {100 * auroc.value:.1f} % and TNR@TPR95 "
            f"{100 * tnr.value:.1f} %, because some horizons of an event begin before it. What "
            "does reliably better has seen the horizon, as forecast errors have: P1 compares them "
            f"with what came true.{_beyond(results, setup, auroc.value)}"
        )
    if any(pd.notna(pick_published(results, setup)) for setup in results.setups):
        sentences.append(
            "Published figures come from other recordings, other code and the paper's protocol; "
            "they stand beside these for orientation."
        )
    return sentences


def _beyond(results: Results, setup: str, oracle: float) -> str:
    """Say which published figure even the oracle does not reach."""
    published = pick_published(results, setup)
    if pd.isna(published) or published <= oracle:
        return ""
    return f" The published AUROC, {100 * published:.1f} %, is above the oracle's."


def pick_published(results: Results, setup: str) -> float:
    """Return the published overall AUROC of the monitor for a set-up, NaN if there is none."""
    value = pick(results, setup, MONITOR, "auroc", protocol="P1")
    return float("nan") if value is None else value.published
