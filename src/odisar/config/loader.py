"""Read ``params.yaml``, whole, before any work; every complaint at once, with the way out."""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from odisar.config.base import PositiveInt, Section
from odisar.config.cases import Case, Maker, Setup
from odisar.config.judging import CapabilityConfig, EvaluationConfig
from odisar.config.learning import MonteCarloConfig, TrainingConfig, TuningConfig, TwinConfig
from odisar.config.registry import RegistryConfig
from odisar.config.simulators import Simulator, SimulatorsConfig
from odisar.config.sources import SourcesConfig
from odisar.config.study import StudyConfig
from odisar.errors import OdisarError

PARAMS_FILE = "params.yaml"

_SIMULATORS: dict[Maker, Simulator] = {"ferry-simulator": "vessel", "robot-simulator": "robot"}

#: Set-ups and cases name files and metrics.
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]


class PipelineConfig(Section):
    """What one run of the pipeline trains and judges, and with how many processes."""

    setups: list[str] = Field(min_length=1)
    workers: PositiveInt
    accelerator: Literal["auto", "cpu", "gpu"]


class TrackingConfig(Section):
    """Where runs are logged: the MLflow experiment."""

    experiment: Annotated[str, Field(min_length=1)]


class ReportConfig(Section):
    """What the report says above its results."""

    title: str
    example_recording: str


class Config(Section):
    """The whole of ``params.yaml``."""

    seed: int = Field(ge=0)
    pipeline: PipelineConfig
    setups: dict[Name, Setup]
    cases: dict[Name, Case]
    twin: TwinConfig
    monte_carlo: MonteCarloConfig
    training: TrainingConfig
    tuning: TuningConfig
    capability: CapabilityConfig
    evaluation: EvaluationConfig
    tracking: TrackingConfig
    registry: RegistryConfig
    report: ReportConfig
    study: StudyConfig
    simulators: SimulatorsConfig
    sources: SourcesConfig
    profiles: dict[str, dict[str, Any]]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(set(self.pipeline.setups)) < len(self.pipeline.setups):
            raise ValueError("pipeline.setups: a set-up is named twice")
        for name in self.pipeline.setups:
            if name not in self.setups:
                raise ValueError(
                    f"pipeline.setups: {name!r} is not declared under setups; declared are: "
                    f"{', '.join(self.setups)}"
                )
        for name in self.study.setups:
            if name not in self.setups:
                raise ValueError(
                    f"study.setups: {name!r} is not declared under setups; declared are: "
                    f"{', '.join(self.setups)}"
                )
        for name, setup in self.setups.items():
            if setup.case not in self.cases:
                raise ValueError(
                    f"setups.{name}.case: {setup.case!r} is not declared under cases; declared "
                    f"are: {', '.join(self.cases)}"
                )
        return self

    @model_validator(mode="after")
    def _check_search(self) -> Self:
        for name in ("model_dim", "layers", "feedforward_dim"):
            value, choices = getattr(self.twin, name), getattr(self.tuning, name)
            if value not in choices:
                raise ValueError(
                    f"tuning.{name}={choices} must hold twin.{name}={value}, which trial 0 takes"
                )
        rates, rate = self.tuning.learning_rate, self.training.learning_rate
        if not rates.low <= rate <= rates.high:
            raise ValueError(
                f"tuning.learning_rate must span training.learning_rate={rate}, which trial 0 takes"
            )
        return self

    @model_validator(mode="after")
    def _check_shapes(self) -> Self:
        odd = [width for width in self.tuning.model_dim if width % self.twin.heads]
        if odd:
            raise ValueError(
                f"tuning.model_dim: {odd} are no multiples of twin.heads={self.twin.heads}"
            )
        for name, case in self.cases.items():
            for field in ("context_steps", "horizon_steps"):
                steps = getattr(case.window, field)
                if steps % self.twin.patch_steps:
                    raise ValueError(
                        f"cases.{name}.window.{field}={steps} must be a multiple of "
                        f"twin.patch_steps={self.twin.patch_steps}"
                    )
            if case.window.context_steps < self.twin.closed_form_lags:
                raise ValueError(
                    f"cases.{name}.window.context_steps={case.window.context_steps} is shorter "
                    f"than twin.closed_form_lags={self.twin.closed_form_lags}: lengthen it, or "
                    "let the closed form look back less"
                )
            shift = case.score.shift
            if shift is not None and shift.memory_steps <= self.twin.closed_form_lags:
                raise ValueError(
                    f"cases.{name}.score.shift.memory_steps={shift.memory_steps} is no longer "
                    f"than twin.closed_form_lags={self.twin.closed_form_lags}: no end of a shift "
                    "could be told; lengthen it, or say shift: null"
                )
        return self

    def case_of(self, setup: str) -> Case:
        """Return the case that a set-up is trained on."""
        return self.cases[self.setups[setup].case]

    @property
    def active_cases(self) -> list[str]:
        """Names of the cases that this pipeline's set-ups need, in order, once each."""
        return list(dict.fromkeys(self.setups[name].case for name in self.pipeline.setups))

    @property
    def active_simulators(self) -> list[Simulator]:
        """The simulators that make recordings of active cases, in order, once each."""
        makers = [self.cases[name].source.maker for name in self.active_cases]
        return list(dict.fromkeys(_SIMULATORS[maker] for maker in makers if maker in _SIMULATORS))

    def recipe_of(self, case_name: str) -> str | None:
        """Return the hash of what decides a simulated case's recordings, None for any other."""
        case = self.cases[case_name]
        simulator = _SIMULATORS.get(case.source.maker)
        if simulator is None:
            return None
        return self.simulators.recipe(simulator, case.channel_names)


class ConfigView:
    """The sections a stage has declared, and no other: an undeclared read fails loudly.

    DVC reruns a stage when the parameters it *declares* change. A stage that reads another one
    would go stale silently, so it cannot.
    """

    def __init__(self, config: Config, sections: tuple[str, ...]) -> None:
        self._config = config
        self.sections = sections

    def __getattr__(self, name: str) -> Any:
        """Return a declared section."""
        if name.startswith("_"):  # asked for while a copy for another process is being built
            raise AttributeError(name)
        if name in ("case_of", "active_cases", "active_simulators", "recipe_of"):
            return getattr(self._config, name)
        if name not in self.sections:
            raise AttributeError(
                f"this stage reads section {name!r} of {PARAMS_FILE} but declares only "
                f"{', '.join(self.sections)}"
            )
        return getattr(self._config, name)


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping; raise OdisarError where it cannot be read or is not one."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise OdisarError(
            f"{path}: cannot be read ({error}); run this in the project's root"
        ) from error
    try:
        loaded = YAML(typ="safe", pure=True).load(text)
    except YAMLError as error:
        raise OdisarError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(loaded, dict):
        raise OdisarError(f"{path}: expected a mapping of sections, found {type(loaded).__name__}")
    return loaded


def parse_config(raw: dict[str, Any], origin: str) -> Config:
    """Validate a whole configuration; every complaint names its key."""
    try:
        return Config.model_validate(raw)
    except ValidationError as error:
        lines = [f"{origin}: {error.error_count()} problem(s), nothing was run:"]
        for problem in error.errors(include_url=False):
            key = ".".join(str(part) for part in problem["loc"]) or "(whole file)"
            given = problem["input"]
            shown = f" (found {given!r})" if not isinstance(given, dict | list | Section) else ""
            lines.append(f"  {key}: {problem['msg'].removeprefix('Value error, ')}{shown}")
        raise OdisarError("\n".join(lines)) from error


def load_config(root: Path) -> Config:
    """Read and validate ``params.yaml`` in ``root``."""
    path = root / PARAMS_FILE
    return parse_config(read_yaml(path), str(PARAMS_FILE))
