"""Draw every figure, execute the notebooks, and write the body of the report."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import pandas as pd
import torch

from odisar.artifacts import Workspace
from odisar.config.loader import ConfigView
from odisar.report.body import render_body
from odisar.report.drawing import draw_figures
from odisar.report.examples import (
    Tested,
    choose_examples,
    describe_example,
    forecasts_table,
    recordings_table,
    traces_table,
    write_examples,
)
from odisar.report.load import Results, report_folder
from odisar.report.notebooks import execute_notebooks
from odisar.report.simulator_checks import check_simulator
from odisar.stages.members import load_member, pipeline_members
from odisar.tracking import TrackedRun
from odisar.twin.bundle import read_twin

PARAMS = (
    "seed",
    "pipeline",
    "setups",
    "cases",
    "twin",
    "monte_carlo",
    "training",
    "tuning",
    "capability",
    "evaluation",
    "report",
    "simulators",
)


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage; the same results give the same bytes."""
    torch.set_num_threads(1)
    folder = report_folder(workspace.root)
    prepare_examples(config, workspace)
    results = Results(workspace, config)
    with ThreadPoolExecutor(1) as pool:
        executing = pool.submit(execute_notebooks, workspace.root, folder / "notebooks")
        figures = draw_figures(results, workspace.figures)
        plausible = []
        for simulator in config.active_simulators:
            table, drawn = check_simulator(simulator, config.simulators, workspace.figures)
            plausible.append(table)
            figures.append(drawn)
        notebooks = executing.result()
    body = render_body(results, figures, notebooks, plausible)
    (folder / "body.html").write_text(body, encoding="utf-8")
    tracked.artifact(workspace.figures, "figures")
    tracked.metrics({"figures": len(figures), "notebooks": len(notebooks)})


def prepare_examples(config: ConfigView, workspace: Workspace) -> None:
    """Write the examples that figures and notebooks show."""
    tested = _tested(config, workspace)
    cases = {setup: config.case_of(setup) for setup in config.pipeline.setups}
    chosen, traces, forecasts = {}, [], []
    for name in config.active_cases:
        case = config.cases[name]
        setups = [s for s in config.pipeline.setups if config.setups[s].case == name]
        own = [one for one in tested if one.setup in setups]
        disturbed, clean = choose_examples(own, case, config.report.example_recording)
        chosen[name] = {"disturbed": describe_example(disturbed, case)}
        if clean is not None:
            chosen[name]["clean"] = describe_example(clean, case)
        shown = [item for item in (disturbed, clean) if item is not None]
        traces.append(traces_table(name, shown, case.channel_names))
        for setup in setups:
            member = _member_of(own, setup, disturbed.name)
            forecasts.append(forecasts_table(setup, read_twin(workspace.twin(member)), disturbed))
    write_examples(
        report_folder(workspace.root) / "examples",
        chosen,
        recordings_table(tested, cases),
        pd.concat(traces, ignore_index=True),
        pd.concat(forecasts, ignore_index=True),
    )


def _tested(config: ConfigView, workspace: Workspace) -> list[Tested]:
    return [
        Tested(member.setup, member.name, recording)
        for member in pipeline_members(config)
        for recording in load_member(config, workspace, member).splits["test"]
    ]


def _member_of(tested: Sequence[Tested], setup: str, recording: str) -> str:
    return next(
        one.member for one in tested if one.setup == setup and one.recording.name == recording
    )
