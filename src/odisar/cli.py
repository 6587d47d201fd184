"""The ``odisar`` command: thin commands on the library; mistakes end in a sentence."""

import argparse
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from odisar.errors import OdisarError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    root = Path.cwd()
    try:
        _COMMANDS[options.command](root, options)
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
    return 0


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
    commands.add_parser("init-store", help="create the MLflow database")
    commands.add_parser("report", help="put the one-file report together again")
    commands.add_parser("results", help="print the result table")
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


def _init_store(root: Path, _options: argparse.Namespace) -> None:
    from odisar.tracking import initialise_store

    initialise_store(root)


def _report(root: Path, _options: argparse.Namespace) -> None:
    from odisar.reproduce import rebuild_report

    rebuild_report(root)


def _results(root: Path, _options: argparse.Namespace) -> None:
    from odisar.reproduce import print_results

    print_results(root)


_COMMANDS = {
    "stage": _stage,
    "data": _data,
    "repro": _repro,
    "profile": _profile,
    "init-store": _init_store,
    "report": _report,
    "results": _results,
}
