"""A proposal as it is put together, and its text as a profile in ``params.yaml``."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from odisar.config.formats import CsvFormat
from odisar.proposals.bag_sniffing import BagLook
from odisar.proposals.guesses import Guess
from odisar.proposals.plans import Extent, Plan, fault_sizes, plan_training, seconds
from odisar.proposals.poses import PoseGuess
from odisar.proposals.times import Pace
from odisar.proposals.yaml_text import flow, limit, line, scalar

_KINDS = ("noise", "bias", "drift", "stuck", "delay")
_COLUMN = 10


@dataclass(frozen=True)
class Draft:
    """Everything that the text of a proposal says."""

    name: str
    folder: str
    title: str
    time_column: str
    time_doubt: str
    layout: CsvFormat | None
    bag: BagLook | None
    rate_hz: float
    rate_doubt: str
    is_held: bool
    pace: Pace
    guesses: Sequence[Guess]
    left_out: Sequence[str]
    pose: PoseGuess | None
    extent: Extent
    plan: Plan

    def text(self) -> str:
        """Return the profile, indented as it stands below ``profiles``."""
        return "\n".join(_profile(self)) + "\n"

    @property
    def max_gap_s(self) -> float:
        """A longer step is a gap: one and a half periods, or more where stamps are uneven."""
        if not self.is_held:
            return _short(1.5 / self.rate_hz)
        return _short(max(1.5 / self.rate_hz, 2.5 / self.pace.slowest_hz))

    @property
    def persistence_s(self) -> float:
        """How long an alarm must last: a tenth of the horizon, five samples at least."""
        return _short(max(min(5, self.plan.horizon), 0.1 * self.plan.horizon) / self.rate_hz)

    @property
    def faulty(self) -> list[str]:
        """Channels that get faults: forecast states that are no part of the pose."""
        apart = self.pose.channels if self.pose else ()
        forecast = [guess.name for guess in self.guesses if guess.output]
        return [name for name in forecast if name not in apart] or forecast


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def _profile(draft: Draft) -> Iterator[str]:
    name = draft.name
    training = plan_training(draft.extent, draft.plan)
    yield line(2, f"{scalar(name)}:", note="proposed by `odisar new-case`; check what is marked ?")
    yield line(4, f"pipeline: {flow(setups=[name])}")
    yield line(4, "setups:")
    yield line(6, f"{scalar(name)}: {flow(case=name, select={}, published_as=None)}")
    yield line(4, "cases:")
    yield line(6, f"{scalar(name)}:")
    yield from _case(draft)
    yield line(
        4,
        "training: "
        + flow(
            epochs=training.epochs,
            steps_per_epoch=training.steps_per_epoch,
            patience_epochs=training.patience_epochs,
            validation_stride_steps=training.validation_stride,
        ),
        note=f"for {draft.extent.hours:.2g} h of recordings",
    )
    yield line(4, f"tuning: {flow(steps_per_trial=training.steps_per_trial)}")
    yield line(4, f"evaluation: {flow(consequence_s=draft.persistence_s)}")
    yield line(4, f"tracking: {flow(experiment=f'odisar-{name}')}")
    yield line(4, f"report: {flow(title=f'ODiSAR on {draft.title}', example_recording='')}")


def _case(draft: Draft) -> Iterator[str]:
    yield line(8, f"title: {scalar(draft.title)}", note="what the report calls the machine")
    yield line(8, "source:")
    yield from _source(draft)
    yield line(8, f"rate_hz: {scalar(draft.rate_hz)}", draft.rate_doubt)
    yield line(8, f"max_gap_s: {scalar(draft.max_gap_s)}")
    yield line(8, "channels:", note="min and max are physically possible, not usual")
    for guess in draft.guesses:
        yield _channel(guess)
    yield from _left_out(draft.left_out)
    yield from _pose(draft)
    yield from _lengths(draft)
    yield from _judging(draft)


def _left_out(items: Sequence[str]) -> Iterator[str]:
    if not items:
        return
    text = "".join(sign if sign.isprintable() else "?" for sign in "; ".join(items))
    at = " " * _COLUMN + "# "
    yield from textwrap.wrap(f"Left out: {text}.", 100, initial_indent=at, subsequent_indent=at)


def _source(draft: Draft) -> Iterator[str]:
    at = _COLUMN
    layout = draft.layout or CsvFormat(separator="comma", decimal="point")
    yield line(at, f"folder: {scalar(draft.folder)}")
    yield line(at, "maker: none")
    yield line(at, f"time_column: {scalar(draft.time_column)}", draft.time_doubt)
    yield line(at, f"max_recordings: {max(200, 2 * len(draft.extent.segments))}")
    yield line(at, f"csv: {flow(separator=layout.separator, decimal=layout.decimal)}")
    if draft.bag is None:
        yield line(at, "bag: null")
    else:
        yield from _bag(draft, draft.bag)
    if not draft.is_held:
        yield line(at, "resample: none")
        return
    why = "stamps are uneven" if draft.pace.rate_hz == draft.rate_hz else "fewer than recorded"
    if draft.pose is not None:
        yield line(at, "resample: thin", f"{why}: the last sample of each period, with its stamp")
    else:
        yield line(at, "resample: hold", f"{why}: each step holds the last sample")


def _bag(draft: Draft, bag: BagLook) -> Iterator[str]:
    at = _COLUMN + 2
    others = [topic.name for topic in bag.topics if topic.name != bag.stamp.name]
    doubt = f"other topics with numbers: {', '.join(others[:8])}" if others else ""
    age_s = max(2 * bag.max_age_s, 2.0 / bag.stamp.rate_hz)
    yield line(_COLUMN, "bag:")
    yield line(at, f"stamp_topic: {bag.stamp.name}", doubt)
    yield line(at, f"stamp: {bag.clock}", _no_header(bag))
    yield line(at, f"max_age_s: {scalar(_short(age_s))}", note="twice the longest pause of a topic")
    yield line(at, "fields:")
    paths = {field.channel: field.path for field in bag.fields}
    for guess in draft.guesses:
        yield line(at + 2, f"{scalar(guess.name)}: {paths[guess.name]}")


def _no_header(bag: BagLook) -> str:
    """Say why the stamps of the headers aren't taken; empty where they are."""
    if bag.undated:
        return f"the header's stamp is 0 in messages of {', '.join(bag.undated[:4])}"
    return "" if bag.stamp.has_header else "no header that is filled"


def _channel(guess: Guess) -> str:
    entry = (
        f"{{name: {scalar(guess.name)}, unit: {scalar(guess.unit)}, role: {guess.role}, "
        f"output: {scalar(guess.output)}, known_ahead: false, "
        f"min: {limit(guess.low)}, max: {limit(guess.high)}}}"
    )
    return line(_COLUMN, f"- {entry}", *guess.doubts)


def _pose(draft: Draft) -> Iterator[str]:
    pose = draft.pose
    if pose is None:
        yield line(8, "pose: null")
        return
    entry = flow(x=pose.x, y=pose.y, heading=list(pose.heading), coordinates="relative")
    yield line(8, f"pose: {entry}", "guessed from names", *pose.doubts)


def _lengths(draft: Draft) -> Iterator[str]:
    plan, rate_hz = draft.plan, draft.rate_hz
    entry = flow(context_steps=plan.context, horizon_steps=plan.horizon)
    seen, ahead = plan.context / rate_hz, plan.horizon / rate_hz
    spans = f"{seen:g} s seen, {ahead:g} s forecast: long enough for the machine?"
    yield line(8, f"window: {entry}", spans, plan.doubt)
    if plan.folds is None:
        shares = {"train": 0.4, "validation": 0.15, "calibration": 0.2, "test": 0.25}
        fractions = shares if plan.kind == "fractions" else None
        entry = flow(
            kind=plan.kind, fractions=fractions, folds=None, block_s=None, block_gap_s=None
        )
        yield line(8, f"splits: {entry}")
        return
    entry = flow(
        kind=plan.kind,
        fractions=None,
        folds=plan.folds,
        block_s=seconds(plan.block, rate_hz),
        block_gap_s=_short(plan.context / rate_hz),
    )
    yield line(8, f"splits: {entry}", note="few recordings: blocks of them take turns")


def _judging(draft: Draft) -> Iterator[str]:
    plan, rate_hz = draft.plan, draft.rate_hz
    lead = max(round(plan.horizon / 5), 1) / rate_hz
    guard = max(min(plan.horizon, plan.fault_duration // 4), 1) / rate_hz
    yield line(8, "score:", note="how many samples each statistic looks back")
    tens = {"mean_steps": 10, "size_steps": 10}
    yield line(12, f"innovation: {flow(**tens, recent_steps=3, recent_share=0.3)}")
    yield line(12, f"consistency: {flow(**tens, recent_steps=1, recent_share=0.4)}")
    scatter = flow(steps=20, share=0.0)
    yield line(12, f"scatter: {scatter}", note="share: raise where disturbances last for minutes")
    noise = flow(lasting_steps=10, recent_steps=3, recent_share=0.5, margin=0.3)
    yield line(12, f"noise: {noise}", note="margin: less hears one noisy sensor sooner")
    shift = flow(memory_steps=100, margin=0.5)
    yield line(12, f"shift: {shift}", note="margin: less hears a sensor that reads wrong sooner")
    release = flow(steps=10, share=0.5)
    yield line(12, f"release: {release}", note="lets go of something strong that is over")
    yield line(
        8,
        f"persistence_s: {scalar(draft.persistence_s)}",
        note="an alarm is a score this long above its threshold",
    )
    yield line(8, f"short_lead_s: {scalar(_short(lead))}")
    yield line(
        8,
        f"guard_start_s: {scalar(_short(guard))}",
        note="P2-guarded leaves out so much of an event's start ...",
    )
    yield line(
        8, f"guard_end_s: {scalar(_short(plan.context / rate_hz))}", note="... and so much after it"
    )
    yield line(8, "groups:")
    if draft.extent.is_labelled:
        yield line(10, "overall: {}", note="judges all disturbed recordings together")
        yield line(10, "group_by: [disturbance]")
        yield line(10, "apart: []")
    else:
        yield line(10, f"overall: {flow(disturbance=list(_KINDS), fault_shows=['shows'])}")
        yield line(10, "group_by: [disturbance, fault_size, fault_channel]")
        yield line(10, "apart: [disturbance, fault_shows]")
    yield line(10, "with_clean: []")
    if draft.extent.is_labelled:
        yield line(8, "faults: null")
    else:
        yield from _faults(draft)
    yield line(8, "range_rules: []")


def _faults(draft: Draft) -> Iterator[str]:
    plan, rate_hz = draft.plan, draft.rate_hz
    sizes, count = fault_sizes(draft.extent, plan, len(draft.faulty))
    drawn = {kind: list(sizes) for kind in ("noise", "bias", "drift")}
    delays = [max(round(plan.horizon * part), 1) / rate_hz for part in (0.2, 0.5)]
    delays = list(dict.fromkeys(map(_short, delays)))[: len(sizes)]
    length = seconds(plan.fault_duration, rate_hz)
    yield line(8, "faults:", "injected: nothing (such as labels.csv) says what is abnormal")
    yield line(10, f"kinds: [{', '.join(_KINDS)}]")
    yield line(10, f"channels: [{', '.join(scalar(name) for name in draft.faulty[:count])}]")
    yield line(10, f"sizes: {flow(**drawn)}", note="standard deviations of the channel")
    yield line(10, "sizes_in: sd")
    yield line(10, "creep: null")
    yield line(10, f"delays_s: [{', '.join(map(scalar, delays))}]")
    yield line(10, f"start_s: {scalar(seconds(plan.fault_start, rate_hz))}")
    yield line(10, f"duration_s: {flow(low=length, high=length)}")
    yield line(10, "shows_from_sd: 0.25")
