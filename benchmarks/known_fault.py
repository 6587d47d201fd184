"""What a detector reaches that has been shown the very fault, beside one that knows no fault.

Nobody has a true model of a real machine, so what could be reached at best is not known. This is
the next best thing: for every fault (kind, channel, size) a logistic regression on the twin's
innovations, and one on parity residuals as well, is trained on copies of calibration recordings
that hold this fault alone, then judged on the test recordings by protocol P2 as the monitor is. It
has been told what to look for, where, and how large it is; the monitor has not. For noise there is
also what the monitor's own statistic of noise says of the guilty channel alone. The last column is
what the twin usually leaves of that channel in one sample, given all others, in the channel's unit.
Run it from the project's root after `make real`:

    .venv/bin/python benchmarks/known_fault.py
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from odisar.artifacts import Workspace, read_json
from odisar.capability.combined import ODISAR, Run
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.innovations import InnovationScore, moving_mean
from odisar.capability.responses import blamed_names
from odisar.capability.scoring import Scorer
from odisar.config.loader import Config, load_config
from odisar.evaluation.labels import label_active
from odisar.evaluation.metrics import auroc, tnr_at_tpr95
from odisar.recordings.faults import inject_faults
from odisar.recordings.schema import Recording
from odisar.stages.members import Member, MemberData, load_member, setup_members
from odisar.twin.bundle import read_twin
from odisar.twin.devices import use_one_thread
from odisar.windows.coordinates import feature_positions
from odisar.windows.scaling import channel_std

Array = NDArray[np.float64]

#: Features of a relative pose: rates along and across the machine.
ALONG_AND_ACROSS = (0, 1)
WORKSPACE, KINDS = Path("workspaces/real"), ("noise", "bias", "creep")
#: Windows of the means that the regression is given, in samples.
WINDOWS = (3, 5, 10, 20)
#: Calibration recordings are copied with so many draws of each fault.
SEEDS = range(4)

#: What a regression is given: it may learn less from more.
GIVEN = INNOVATIONS, ALL = "shown, innovations", "shown, all"
#: The monitor's own statistic, which is told the channel alone.
OWN = "its channel"
USUAL = "usual innovation"

#: Kind, channel and size of a fault.
Fault = tuple[str, str, str]


@dataclass(frozen=True)
class Seen:
    """A faulty recording as a twin saw it: (time, ...) what is known, and what is true.

    ``features`` are (time, feature) by what is given, ``untold`` (time,) scores of the monitor and
    of its statistic of noise, which know no fault.
    """

    features: dict[str, Array]
    untold: dict[str, Array]
    labels: NDArray[np.bool_]


class Watcher:
    """A member's twin, and what it knows of recordings with one fault."""

    def __init__(self, config: Config, workspace: Workspace, member: Member) -> None:
        self.data: MemberData = load_member(config, workspace, member)
        limits = read_json(workspace.thresholds(member.setup))["members"][member.name]
        fitted = InnovationScoreValues.model_validate(limits["innovation"]).build()
        self._fitted, self._noise = fitted.parts, fitted.noise
        self._score: InnovationScore = fitted.parts.twin
        self._threshold: float = limits["sigma"][ODISAR]
        self._scorer = Scorer(read_twin(workspace.twin(member.name)), 256, "cpu", fitted)

    def faulty(self) -> tuple[list[Recording], list[Recording]]:
        """Return calibration recordings with faults, and the test recordings that have some."""
        std = channel_std(self.data.splits["train"])
        calibration, case = self.data.splits["calibration"], self.data.case
        copies = [item for seed in SEEDS for item in inject_faults(calibration, case, std, seed)]
        return copies, self.data.splits["test"]

    def watch(self, recordings: Sequence[Recording]) -> Iterator[tuple[Fault, Seen]]:
        """Yield each recording's fault and what is seen of it, from run to run.

        As in the pipeline's tables a run counts from the first time a forecast error could be
        known, and scores are in multiples of the twin's own threshold.
        """
        for item in recordings:
            info = item.info
            fault = info.disturbance, info.column("fault_channel"), info.column("fault_size")
            if fault[0] in KINDS:
                found = self._scorer.score(item, short_lead_steps=self.data.case.short_lead_steps)
                labels = label_active(item.time_s[found.positions], item.intervals)
                score = found.scores[ODISAR].astype(np.float64) / self._threshold
                runs = self._scorer.runs(item, found)
                for (start, stop), parts in zip(found.runs, runs, strict=True):
                    seen = found.innovations[start:stop]
                    tied = self._fitted.relations.residuals(found.samples[start:stop])
                    known = slice(self.data.spec.horizon_steps, None)
                    columns = self.columns(fault[1])
                    told = informed(seen, columns, self._score)[known]
                    more = informed(tied, columns, self._fitted.consistency)[known]
                    features = {INNOVATIONS: told, ALL: np.hstack([told, more])}
                    run = slice(start + self.data.spec.horizon_steps, stop)
                    untold = {"ODiSAR": score[run]}
                    if fault[0] == "noise":
                        untold[OWN] = self.noise(parts, fault[1])[known]
                    yield fault, Seen(features, untold, labels[run])

    def noise(self, run: Run, channel: str) -> Array:
        """Return (time,) what the monitor's statistic of noise says of one channel."""
        squares = run.outliers(self._fitted.closed_form.size.precision)
        state = blamed_names(self._scorer.twin).index(channel)
        return self._noise.score(squares[:, [state]])

    def columns(self, channel: str) -> list[int]:
        """Return where a channel stands among the state features.

        A position of a relative pose shows along and across the machine, by where it heads.
        """
        spec, names = self.data.spec, list(self.data.case.channel_names)
        at, states = names.index(channel), spec.state_features(len(names))
        if spec.pose is not None and at in (spec.pose.x, spec.pose.y):
            return [states.index(feature) for feature in ALONG_AND_ACROSS]
        (feature,) = feature_positions([at], len(names), spec.pose)
        return [states.index(feature)]

    def usual(self, channel: str) -> float:
        """Return the spread of a channel's innovations given all others, in the channel's unit."""
        spec, column = self.data.spec, self.columns(channel)[0]
        feature = spec.state_features(len(self.data.case.channels))[column]
        scaled = 1 / np.sqrt(self._score.size.precision[column, column])
        return float(scaled * self.data.scaler.std[feature])


def informed(innovations: Array, columns: Sequence[int], score: InnovationScore) -> Array:
    """Return (time, feature) what the regression is given of innovations or parity residuals.

    Means over several windows of the guilty channel given all others (its size, and with its
    sign) and of what leans its way, and the monitor's own two statistics.
    """
    precision = score.size.precision
    limit = score.mean.limit
    drawn_in = innovations if limit is None else limit.of(innovations)
    given: list[Array] = []
    for column in columns:
        own = (innovations @ precision)[:, column] / np.sqrt(precision[column, column])
        lean = (drawn_in @ precision)[:, column]
        parts = np.log1p(own**2), own, lean
        given += [moving_mean(part, steps) for steps in WINDOWS for part in parts]
    return np.column_stack([*given, *score.parts(innovations)])


def judged(watchers: Sequence[Watcher]) -> pd.DataFrame:
    """Return a row for each fault, over all members of a set-up."""
    scores: dict[Fault, dict[str, list[Array]]] = {}
    truth: dict[Fault, list[NDArray[np.bool_]]] = {}
    for watcher in watchers:
        copies, test = watcher.faulty()
        shown: dict[Fault, list[Seen]] = {}
        for fault, seen in watcher.watch(copies):
            shown.setdefault(fault, []).append(seen)
        models = {
            (name, fault): Told.by(parts, name) for fault, parts in shown.items() for name in GIVEN
        }
        for fault, seen in watcher.watch(test):
            known = np.isfinite([*seen.features[ALL].T, *seen.untold.values()]).all(axis=0)
            said = {name: values[known] for name, values in seen.untold.items()}
            for name in GIVEN:
                said[name] = models[name, fault].score(seen.features[name][known])
            truth.setdefault(fault, []).append(seen.labels[known])
            for name, values in said.items():
                scores.setdefault(fault, {}).setdefault(name, []).append(values)
    rows = []
    for fault in sorted(truth):
        labels = np.concatenate(truth[fault])
        row: dict[str, object] = dict(zip(("kind", "channel", "size"), fault, strict=True))
        for name, parts in scores[fault].items():
            row[f"{name}, AUROC"] = auroc(np.concatenate(parts), labels)
            row[f"{name}, TNR@TPR95"] = tnr_at_tpr95(np.concatenate(parts), labels)
        row[USUAL] = np.mean([watcher.usual(fault[1]) for watcher in watchers])
        rows.append(row)
    table = pd.DataFrame(rows)
    return table[[*table.columns.drop(USUAL), USUAL]]


@dataclass(frozen=True)
class Told:
    """A regression of what is true on what is known; folds are put on one scale."""

    model: Pipeline
    usual: float
    spread: float

    @classmethod
    def by(cls, parts: Sequence[Seen], given: str) -> "Told":
        """Train on faulty calibration recordings; their healthy part says what is usual."""
        features = np.concatenate([part.features[given] for part in parts])
        labels = np.concatenate([part.labels for part in parts])
        known = np.isfinite(features).all(axis=1)
        features, labels = features[known], labels[known]
        model = make_pipeline(StandardScaler(), LogisticRegression(max_iter=2000))
        model.fit(features, labels)
        healthy = model.decision_function(features[~labels])
        return cls(model, float(healthy.mean()), float(healthy.std()))

    def score(self, features: Array) -> Array:
        """Return (time,) how sure it is of the fault, in standard deviations of the healthy."""
        said = self.model.decision_function(features)
        return np.asarray((said - self.usual) / self.spread)


def main() -> None:
    """Print a table for each set-up of the real workspace."""
    use_one_thread()
    config, workspace = load_config(WORKSPACE), Workspace(WORKSPACE)
    for setup in config.pipeline.setups:
        watchers = [Watcher(config, workspace, member) for member in setup_members(config, setup)]
        print(setup)
        print(judged(watchers).round(4).to_string(index=False), end="\n\n")


if __name__ == "__main__":
    main()
