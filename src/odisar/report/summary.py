"""The summary: sentences whose numbers, and whose presence, follow from the result tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from odisar.report.certainty import certainty
from odisar.report.detectors import MONITOR, ORACLE
from odisar.report.failings import failings
from odisar.report.gains import monitor_gain, transformer_gain
from odisar.report.load import Results
from odisar.report.names import METRIC_NAMES
from odisar.report.picking import at_strength, percent, pick, selection

#: What every twin does, whatever the case.
_METHOD = (
    "A twin learns from undisturbed recordings to forecast the next sample and a horizon. The "
    "score holds what it, and the closed form it stands on, said about now against what is "
    "observed (the innovations), each state of the sample against what the others say it should "
    "be (consistency), how well the twin reconstructs its own forecast, and whether one sensor's "
    "samples are off by themselves (noise) or have been off together since some moment (a shift); "
    "where that is rarer than on undisturbed recordings, the machine is taken to be out of "
    "distribution. The paper's score is the reconstruction alone."
)


@dataclass(frozen=True)
class Summary:
    """Sentences by topic; those that differ between set-ups by set-up's heading.

    ``gains`` come first: what the Transformer adds to what can be had without it.
    """

    gains: Sequence[str]
    lead: Sequence[str]
    found: Mapping[str, Sequence[str]]
    certainty: Sequence[str]
    failings: Mapping[str, Sequence[str]]
    reading: Sequence[str]


def summarise(results: Results) -> Summary:
    """Return the summary of a workspace's results."""
    titles = {setup: setup_title(results, setup) for setup in results.setups}
    return Summary(
        gains=[told for setup in results.setups for told in transformer_gain(results, setup)],
        lead=[_METHOD, *(_lead(results, case) for case in results.cases)],
        found={title: _found(results, setup) for setup, title in titles.items()},
        certainty=certainty(results),
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
        f"{given.title}: the twin looks at the last {context_s:g} s and forecasts the next "
        f"{horizon_s:g} s. It was tested on {_tested_on(known, noun)}, none of which the twin at "
        "test had seen."
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
    return sentences + _alarms(results, setup) + monitor_gain(results, setup)


def _alarms(results: Results, setup: str) -> list[str]:
    detected = pick(results, setup, MONITOR, "events_detected")
    if detected is None:
        return []
    delay = pick(results, setup, MONITOR, "delay_p50_s")
    half_s = None if delay is None else round(delay.value, 1)
    soon = "" if half_s is None else f", half of them within {half_s:g} s of their onset"
    rate = pick(results, setup, MONITOR, "false_alarms_per_hour")
    price = ""
    if rate is not None:
        price = (
            f", at {rate.value:.2f} false alarms per hour ({rate.low:.2f} to {rate.high:.2f}) in "
            f"{_undisturbed_hours(results, setup):.1f} undisturbed hours"
        )
    where = at_strength(results.strengths(setup)[-1]) or "overall"
    return [f"{where.capitalize()}, alarms found {percent(detected)} of the events{soon}{price}."]


def _undisturbed_hours(results: Results, setup: str) -> float:
    """Return the hours in which false alarms were counted."""
    rows = results.operating
    return float(rows[(rows.setup == setup) & (rows.detector == MONITOR)].hours.sum())


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
        (
            "ODiSAR is a mean: of the twin's innovations, of its closed form's, of the consistency "
            "of one sample and, where a case gives it a share, of scatter that adds up over many "
            "samples. Where the noise of one sensor, or its shift, is rarer than this mean, it "
            "counts instead. "
            "Of what a score has fallen below a strong peak of its own a share is taken off as "
            "well, as windows remember what is over. "
            "The closed form (with its scatter) and consistency stand beside it alone; all but "
            "the Transformer together are ODiSAR without Transformer."
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
            "they stand beside these for orientation. Those of ODiSAR stand beside two scores: the "
            "reconstruction is how the paper scores."
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
