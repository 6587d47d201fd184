"""The ``odisar`` command: thin commands on the library; mistakes end in a sentence."""

import argparse
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from odisar.errors import OdisarError

# NumPy's threads would compete with the processes that share the cores: an eigenvalue problem of
# 420 states then takes seconds instead of a tenth.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    # Before any command's imports: libraries read them once, when they are loaded.
    for variable in _ONE_THREAD:
        os.environ.setdefault(variable, "1")
    parser = _parser()
    options = parser.parse_args(arguments)
    root = Path.cwd()
    try:
        code = _COMMANDS[options.command](root, options)
    except OdisarError as error:
        if options.debug:
            traceback.print_exc()
        print(f"odisar: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("odisar: interrupted; the same command goes on from here", file=sys.stderr)
        return 130
    except Exception as error:  # noqa: BLE001 (the boundary: a sentence, not a traceback)
        if options.debug:
            traceback.print_exc()
        kind = type(error).__name__
        print(
            f"odisar: unexpected {kind}: {error}\nThis is a fault of the program, not of your data."
            " `--debug` before the command shows where it happened.",
            file=sys.stderr,
        )
        return 2
    return code or 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="odisar", description=__doc__)
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")
    stage = commands.add_parser("stage", help="run one stage of the pipeline (dvc.yaml does)")
    stage.add_argument("name")
    data = commands.add_parser("data", help="make the recordings and check them against data.dvc")
    data.add_argument("--accept", action="store_true", help="take the recordings as they are")
    commands.add_parser("repro", help="recordings, pipeline, result table")
    profile = commands.add_parser("profile", help="run the pipeline with a profile's parameters")
    profile.add_argument("name")
    study = commands.add_parser("study", help="run one part of the study (study/dvc.yaml does)")
    study.add_argument("part")
    study.add_argument("setup", nargs="?", help="of a part that is run once for each set-up")
    leakage = commands.add_parser("leakage", help="probe your own score for what it may not know")
    leakage.add_argument("model", help="package.module:function, recordings to arrays of scores")
    leakage.add_argument("--setup", required=True, help="whose recordings it is probed on")
    leakage.add_argument("--delay-steps", type=int, default=0, help="how late it may notice")
    commands.add_parser("init-store", help="create the MLflow database")
    report = commands.add_parser("report", help="bring the report up to date (make repro first)")
    results = commands.add_parser("results", help="print the result table")
    for command in (report, results):
        command.add_argument("--profile", help="of this profile's workspace")
    promote = commands.add_parser("promote", help="make a registered version the champion")
    promote.add_argument("model")
    promote.add_argument("version")
    new_case = commands.add_parser("new-case", help="propose a profile for your own recordings")
    new_case.add_argument("folder", type=Path, help="holds a file or a bag for each recording")
    new_case.add_argument("--name", help="of the profile and its case (else that of the folder)")
    new_case.add_argument("--write", action="store_true", help="put it into params.yaml")
    new_case.add_argument("--rate-hz", type=float, help="work at this rate (else as recorded)")
    new_case.add_argument("--context-s", type=float, help="seconds that the twin sees")
    new_case.add_argument("--horizon-s", type=float, help="seconds that it forecasts")
    inspect = commands.add_parser("inspect", help="check recordings, without running anything")
    inspect.add_argument("folder", type=Path)
    declared = inspect.add_mutually_exclusive_group()
    declared.add_argument("--profile", help="check them as this profile declares them")
    declared.add_argument("--case", help="check them as this case declares them")
    return parser


# Imports wait until a command needs them: torch alone takes seconds.


def _stage(root: Path, options: argparse.Namespace) -> None:
    from odisar.stages.runner import STAGES, run_stage

    if options.name not in STAGES:
        raise OdisarError(f"there is no stage {options.name!r}; stages are {', '.join(STAGES)}")
    run_stage(options.name, root)


def _data(root: Path, options: argparse.Namespace) -> None:
    from odisar.making import make_recordings, track_recordings

    make_recordings(root)
    track_recordings(root, accept=options.accept)


def _repro(root: Path, _options: argparse.Namespace) -> None:
    from odisar.reproduce import reproduce

    reproduce(root)


def _profile(root: Path, options: argparse.Namespace) -> None:
    from odisar.reproduce import reproduce_profile
    from odisar.workspaces import lay_out

    reproduce_profile(root, lay_out(root, options.name))


def _study(root: Path, options: argparse.Namespace) -> None:
    from odisar.study.runner import run_part

    run_part(options.part, options.setup, root)


def _leakage(root: Path, options: argparse.Namespace) -> int:
    from odisar.study.leakage import probe_own_model

    report = probe_own_model(root, options.model, options.setup, options.delay_steps)
    print("\n".join(report.sentences()))
    return 0 if report.passed else 1


def _init_store(root: Path, _options: argparse.Namespace) -> None:
    from odisar.tracking import initialise_store

    initialise_store(root)


def _report(root: Path, options: argparse.Namespace) -> None:
    from odisar.reproduce import rebuild_report

    rebuild_report(root, options.profile)


def _results(root: Path, options: argparse.Namespace) -> None:
    from odisar.reproduce import print_results, workspace_of

    print_results(workspace_of(root, options.profile))


def _promote(root: Path, options: argparse.Namespace) -> None:
    from odisar.tracking.registry import promote

    print(promote(root, options.model, options.version))


def _new_case(root: Path, options: argparse.Namespace) -> None:
    from odisar.proposals.new_case import propose
    from odisar.proposals.plans import Wishes
    from odisar.proposals.summary import summary
    from odisar.proposals.writing import write_profile

    wishes = Wishes(options.rate_hz, options.context_s, options.horizon_s)
    proposal = propose(root, options.folder, options.name, _say, write=options.write, wishes=wishes)
    print(f"profiles:\n{proposal.text}", end="", flush=True)
    if options.write:
        write_profile(root, proposal.name, proposal.text)
    _say(f"\n{summary(proposal, options.folder, written=options.write)}")


def _inspect(root: Path, options: argparse.Namespace) -> int:
    from odisar.proposals.choosing import choose_case
    from odisar.proposals.inspection import inspect_case

    chosen = choose_case(root, options.folder, options.profile, options.case, _say)
    report = inspect_case(chosen.case, chosen.result, chosen.origin)
    print(f"{report.text}\n\n{report.counts}")
    return 1 if report.errors else 0


def _say(text: str) -> None:
    print(text, file=sys.stderr)


_COMMANDS: dict[str, Callable[[Path, argparse.Namespace], int | None]] = {
    "stage": _stage,
    "data": _data,
    "repro": _repro,
    "profile": _profile,
    "study": _study,
    "leakage": _leakage,
    "init-store": _init_store,
    "report": _report,
    "results": _results,
    "promote": _promote,
    "new-case": _new_case,
    "inspect": _inspect,
}
