"""Probe the study's alternatives, of which the published recipe leaks, and a user's own model."""

from pathlib import Path

import pandas as pd

from odisar.artifacts import Workspace, write_table
from odisar.baselines.neural.registry import NOT_DEPLOYABLE
from odisar.config.loader import Config, ConfigView, load_config
from odisar.errors import OdisarError
from odisar.evaluation.leakage import probe_leakage
from odisar.evaluation.leakage_report import LeakageReport, leakage_table
from odisar.evaluation.own_model import load_own_model
from odisar.seeding import derive_seed
from odisar.stages.detectors import member_reference
from odisar.stages.leakage import probe, probed_recordings
from odisar.stages.members import load_member, setup_members
from odisar.study.alternatives import all_alternatives
from odisar.twin.bundle import read_twin
from odisar.windows.scaling import channel_std

#: Share of its steps that a network is trained for before it is probed.
_TRAINED_SHARE = 0.1

PARAMS = ("seed", "pipeline", "setups", "cases", "study")


def run(config: ConfigView, workspace: Workspace) -> None:
    """Write leakage.csv: every alternative of the study; the pipeline probes its own detectors.

    The first of the study's set-ups is taken. What a score may see doesn't depend on how long its
    network was trained: all but the published recipe, whose leak is shown at its full size, are
    trained for a share of their steps.
    """
    setup = config.study.setups[0]
    member = setup_members(config, setup)[0]
    data = load_member(config, workspace, member)
    reference = member_reference(data, config.seed)
    twin = read_twin(workspace.twin(member.name))
    short, full = (all_alternatives(config, twin, share) for share in (_TRAINED_SHARE, 1.0))
    reports = []
    for name in sorted(short, key=NOT_DEPLOYABLE.__contains__):
        detector = (full if name in NOT_DEPLOYABLE else short)[name]()
        detector.fit(reference)
        reports.append(
            probe(
                data,
                name,
                detector.score,
                probed_recordings(data),
                config.seed,
                # Some score every few samples only and hold what they said.
                control_delay_steps=data.spec.horizon_steps,
            )
        )
    table = leakage_table(reports).assign(setup=setup, member=setup)
    write_table(workspace.study_results / "leakage.csv", pd.DataFrame(table))


def probe_own_model(root: Path, model: str, setup: str, delay_steps: int) -> LeakageReport:
    """Probe a user's own score on beginnings of calibration recordings of a set-up.

    ``model`` is ``package.module:function``, looked for from the current folder first. Raises
    OdisarError for an unknown set-up, or a model that can't be found or called.
    """
    config: Config = load_config(root)
    if setup not in config.setups:
        raise OdisarError(f"set-up {setup!r} is not declared; declared: {', '.join(config.setups)}")
    view = ConfigView(config, PARAMS)
    data = load_member(view, Workspace(root), setup_members(view, setup)[0])
    own = load_own_model(model, Path.cwd())
    return probe_leakage(
        own.name,
        own.score,
        probed_recordings(data),
        std=channel_std(data.splits["train"]),
        seed=derive_seed(config.seed, "leakage"),
        states=[i for i, c in enumerate(data.case.channels) if c.role == "state"],
        control_delay_steps=delay_steps,
    )
