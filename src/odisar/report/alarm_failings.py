"""What does not work about alarms: promises broken, events missed or met too late."""

from odisar.report.detectors import MONITOR
from odisar.report.load import OVERALL, Results, rows_of
from odisar.report.picking import Value, at_strength, lead_time_note, percent, pick


def alarm_failings(results: Results, setup: str) -> list[str]:
    """Return a sentence for every failing of a set-up's alarms."""
    checks = (_promise, _promise_by_group, _flags, _missed, _late)
    return [sentence for check in checks for sentence in check(results, setup)]


def _promise(results: Results, setup: str) -> list[str]:
    value = pick(results, setup, MONITOR, "false_alarms_per_hour")
    promised = results.config.evaluation.operating_point.promised_per_hour
    if value is None:
        return ["There was no undisturbed test recording, so false alarms were not counted."]
    rate = f"{value.value:.2f} per hour ({value.low:.2f} to {value.high:.2f})"
    return _promise_sentences(value, promised, rate)


def _promise_sentences(value: Value, promised: float, rate: str) -> list[str]:
    if value.value > promised and value.low <= promised:
        return [
            (
                f"The promise of at most {promised:g} false alarm per hour was not held: {rate}; "
                "the interval includes the promise."
            )
        ]
    if value.value > promised:
        return [f"The promise of at most {promised:g} false alarm per hour was broken: {rate}."]
    if value.high > promised:
        return [
            (
                f"False alarms kept the promise of at most {promised:g} per hour, {rate}, but in "
                "too few hours to be sure of it."
            )
        ]
    return []


def _promise_by_group(results: Results, setup: str) -> list[str]:
    """Name manoeuvres (or other groups) whose undisturbed recordings alarm more than promised."""
    promised = results.config.evaluation.operating_point.promised_per_hour
    table = results.detection
    rows = table[(table.setup == setup) & (table.metric == "false_alarms_per_hour")]
    rows = rows[(rows.detector == MONITOR) & (rows.evaluated_on != OVERALL)]
    rows = rows[rows.value > promised].sort_values("value", ascending=False, kind="stable")
    told = [
        f"{row.evaluated_on} {row.value:.2f} per hour ({row.ci_low:.2f} to {row.ci_high:.2f}"
        f"{', which includes the promise' if row.ci_low <= promised else ''})"
        for row in rows_of(rows)
    ]
    if not told:
        return []
    return [
        (
            f"More than the promised {promised:g} false alarm per hour on undisturbed recordings "
            f"of: {', '.join(told)}."
        )
    ]


def _missed(results: Results, setup: str) -> list[str]:
    sentences = []
    for strength in results.strengths(setup):
        value = pick(results, setup, MONITOR, "events_detected", strength)
        if value is not None and value.value < 0.5:
            where = at_strength(strength) or "overall"
            sentences.append(
                f"{where.capitalize()} fewer than half of the events raised an alarm: "
                f"{percent(value)}."
            )
    return sentences


def _late(results: Results, setup: str) -> list[str]:
    value = pick(results, setup, MONITOR, "lead_time_p50_s")
    if value is None or value.value > 0:
        return []
    where = at_strength(results.strengths(setup)[-1]) or "overall"
    late_s = round(-value.value)
    when = f"{late_s} s after" if late_s else "at the moment at which"
    sentence = (
        f"{where.capitalize()} the median alarm comes {when} a state has left its calibrated "
        "range, not before."
    )
    return [f"{sentence} {lead_time_note(results, setup)}".strip()]


def _flags(results: Results, setup: str) -> list[str]:
    """Say where the threshold that decides OOD would be no threshold for alarms."""
    rule = results.config.capability.threshold_rule
    promised = results.config.evaluation.operating_point.promised_per_hour
    rows = results.rules
    rows = rows[(rows.setup == setup) & (rows.detector == MONITOR) & (rows.rule == rule)]
    rows = rows[rows.ci_low > promised]
    return [
        (
            f"The threshold that decides OOD (rule {rule!r}) is none for alarms: it would raise "
            f"{row.measured_per_hour:.2f} per hour ({row.ci_low:.2f} to {row.ci_high:.2f}) on "
            "undisturbed recordings."
        )
        for row in rows_of(rows.head(1))
    ]
