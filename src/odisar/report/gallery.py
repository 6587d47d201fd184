"""The list of figures: what each shows, and where it stands in the report."""

from odisar.report.exhibits import Plate
from odisar.report.figures.baselines import (
    alternatives_by_strength,
    baselines_by_scenario,
    baselines_by_strength,
    components_apart,
    has_alternatives,
    has_components,
    has_groups,
    has_strengths,
    has_study_networks,
    protocols,
    study_by_strength,
)
from odisar.report.figures.blame import guilty_channel, has_blame
from odisar.report.figures.delays import delay_over_false_alarms
from odisar.report.figures.events import (
    attribution_shares,
    event_attribution,
    fault_heat_map,
    forecast_examples,
    has_faults,
    has_flagged,
)
from odisar.report.figures.forecasting import (
    error_by_step,
    has_forecasts,
    has_studied_forecasts,
    studied_error_by_step,
)
from odisar.report.figures.leakage import leakage_panel
from odisar.report.figures.learning import training_curves
from odisar.report.figures.onsets import score_around_onset
from odisar.report.figures.operating import operating_point
from odisar.report.figures.pairs import has_pairs, paired_differences
from odisar.report.figures.quadrants import (
    has_quadrants,
    quadrant_distribution,
    quadrant_scatter,
)
from odisar.report.figures.ranking import roc_by_strength
from odisar.report.figures.recordings import recordings_overview
from odisar.report.figures.reliability import reliability_diagram
from odisar.report.judged import has_events, has_false_alarm_hours
from odisar.report.picking import lead_time_note, left_out_note

_BEST = (
    "Of the cheap alternatives only that with the best mean AUROC on these very recordings is "
    "drawn."
)

_CUT = "Axes begin where the lowest value needs it."

PLATES = (
    Plate(
        "roc",
        "ROC curves by strength (P2)",
        "effectiveness",
        "ROC curves under P2 (the score at t against 'disturbed at t'), exact, over all scored "
        f"times of the recordings that count overall; below, where false alarms are rare. {_BEST}",
        roc_by_strength,
        applies=has_events,
    ),
    Plate(
        "onset",
        "The score around the onset of events",
        "effectiveness",
        "Every event aligned at its onset: median and the band that holds 10-90 % of the events, "
        "of ODiSAR and of the paper's score, each in multiples of its own alarm threshold.",
        score_around_onset,
        applies=has_events,
    ),
    Plate(
        "delay",
        "Delay against false alarms",
        "effectiveness",
        "The median delay of alarms over all thresholds, against the false alarms that they cost; "
        "markers with a dark rim are the operating points, set on calibration recordings. Curve "
        f"and marker are missing where the median event is missed. {_BEST}",
        delay_over_false_alarms,
        applies=has_false_alarm_hours,
    ),
    Plate(
        "operating-point",
        "Alarms at the operating point",
        "effectiveness",
        "Alarms at the operating point: false alarms with exact Poisson intervals, events found, "
        "delay after onset, and median time from alarm to consequence (below zero: too late). "
        f"{_BEST}",
        operating_point,
        note=lead_time_note,
    ),
    Plate(
        "fault-heat-map",
        "Share of faulty time that is flagged",
        "effectiveness",
        "Share of the faulty time with a score above its threshold, by fault and channel.",
        fault_heat_map,
        applies=has_faults,
    ),
    Plate(
        "apart",
        "Judged apart from the overall rows (P2)",
        "effectiveness",
        "What is left out of the overall rows and judged apart, beside the overall at the same "
        "strength (P2). Groups that are disturbed from end to end are ranked against the "
        "undisturbed test recordings.",
        components_apart,
        applies=has_components,
    ),
    Plate(
        "quadrants",
        "Confidence quadrants by scenario",
        "confidence",
        "Share of assessed windows in each confidence quadrant. Windows of disturbed recordings "
        "before, in and after the event count, as published.",
        quadrant_distribution,
        applies=has_quadrants,
        note=left_out_note,
    ),
    Plate(
        "quadrant-scatter",
        "Every assessed window by score and variance",
        "confidence",
        "Every assessed window of the test recordings: right of the dashed line is OOD, above the "
        "dotted line is uncertain. If the variance told disturbed from undisturbed windows, the "
        "right panel's points would lie higher.",
        quadrant_scatter,
    ),
    Plate(
        "reliability",
        "Reliability of the forecasts, before and after recalibration",
        "confidence",
        "How often the truth lies at or below each quantile of the forecast, on undisturbed test "
        "recordings: on the diagonal a forecast is as sure as it says, and a curve flatter than it "
        "is too sure of itself. The noise floor was fitted on validation recordings, the "
        "recalibration on calibration recordings.",
        reliability_diagram,
    ),
    Plate(
        "baselines-by-strength",
        "The twin's scores by strength of the disturbance (P2)",
        "alternatives",
        "The twin's scores and the errors of its forecasts by strength of the disturbance under "
        f"P2. Hollow diamonds, if any: published, with other data and another protocol. {_CUT}",
        baselines_by_strength,
        applies=has_strengths,
    ),
    Plate(
        "pairs",
        "ODiSAR minus each other detector (P2)",
        "alternatives",
        "ODiSAR minus each other detector on the same recordings, with the paired bootstrap's "
        "95 % interval: where it includes 0, the recordings do not tell the two apart. Axes are "
        "logarithmic beyond 1.",
        paired_differences,
        applies=has_pairs,
    ),
    Plate(
        "alternatives",
        "ODiSAR and cheap alternatives (P2)",
        "alternatives",
        "ODiSAR beside what a user would try first: detectors fitted in seconds, without a twin, "
        f"under P2. {_CUT}",
        alternatives_by_strength,
        applies=has_alternatives,
    ),
    Plate(
        "networks",
        "ODiSAR and other networks (P2, from the study)",
        "alternatives",
        "ODiSAR and the paper's score beside other networks, under P2, from the study. The "
        "published recipe sees the future it is to judge, and other recordings: it cannot be "
        "deployed and stands here for what such leaks are worth.",
        study_by_strength,
        applies=has_study_networks,
    ),
    Plate(
        "baselines-by-scenario",
        "The twin's scores by scenario (P2)",
        "alternatives",
        "The twin's scores and the errors of its forecasts by scenario under P2, at the greatest "
        f"strength if there are several. {_CUT}",
        baselines_by_scenario,
        applies=has_groups,
        note=left_out_note,
    ),
    Plate(
        "leakage",
        "What leakage probes found",
        "alternatives",
        "Probes for leakage: what may not move the score at t was changed, and what must move it. "
        "Told is in how many tries the score moved, and the largest move in interquartile ranges "
        "(IQR) of the score. The study's may take a horizon: some score every few samples only.",
        leakage_panel,
    ),
    Plate(
        "protocols",
        "The same scores under four protocols",
        "protocols",
        "The same scores under four protocols, at the greatest strength if there are several. The "
        "oracle knows whether a disturbance is active now and nothing of the future; under P1 it "
        f"cannot be perfect. {_CUT}",
        protocols,
    ),
    Plate(
        "forecasts",
        "Forecasts before, soon after and in an event",
        "events",
        "Forecasts issued just before the event, soon after its onset and in its middle, with "
        "what was recorded. The recorded future is drawn for comparison; the twin never sees it.",
        forecast_examples,
    ),
    Plate(
        "event",
        "One event: score, quadrants, blamed states",
        "events",
        "One event: the score as it was known at each time, the quadrant of each assessed window, "
        "and the states blamed in windows flagged as OOD. Quadrant and blame are drawn over the "
        "forecast's horizon.",
        event_attribution,
    ),
    Plate(
        "attribution",
        "States that flagged windows blame",
        "events",
        "Which states the flagged windows blame, at the greatest strength if there are several.",
        attribution_shares,
        applies=has_flagged,
        note=left_out_note,
    ),
    Plate(
        "guilty",
        "Is the guilty channel named?",
        "events",
        "Where a fault was put on a known channel: how often that channel is blamed, with 95 % "
        "intervals, beside what naming states at random would reach. By what explains ODiSAR's "
        "score, and as the paper does, by the error of reconstruction (of forecast states alone).",
        guilty_channel,
        applies=has_blame,
    ),
    Plate(
        "forecast-error",
        "Forecast error by step",
        "learning",
        "Root mean square error of forecasts of undisturbed test recordings by step, beside "
        "forecasters that are fitted in seconds and know as much of the commands as the twin.",
        error_by_step,
        applies=has_forecasts,
    ),
    Plate(
        "forecast-error-study",
        "Forecast error by step (from the study)",
        "learning",
        "The same of more forecasters; networks see equally many windows, fewer than the twin did. "
        "The commands of the horizon are unknown, unless all know them.",
        studied_error_by_step,
        applies=has_studied_forecasts,
    ),
    Plate(
        "recordings",
        "A disturbed and an undisturbed test recording",
        "recordings",
        "Every channel of one disturbed and one undisturbed test recording; commands in grey.",
        recordings_overview,
        scope="case",
    ),
    Plate(
        "training",
        "Training: the parts of the loss",
        "learning",
        "Training of each twin. The twin with the lowest validation loss is kept.",
        training_curves,
    ),
)
