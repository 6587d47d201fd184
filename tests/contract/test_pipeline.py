"""dvc.yaml against the code: what a stage reads, it declares."""

import ast
import importlib
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from odisar.stages.runner import STAGES

ROOT = Path(__file__).resolve().parent.parent.parent
PIPELINE = YAML(typ="safe").load((ROOT / "dvc.yaml").read_text())["stages"]
#: Named in no stage: they carry a stage but cannot change its outcome.
PLUMBING = {"errors.py", "__init__.py"}
TRACKING = ROOT / "src/odisar/tracking"


def imported_files(module: str) -> set[Path]:
    """Return the project files a module imports, directly or not."""
    found: set[Path] = set()
    waiting = [module]
    while waiting:
        path = ROOT / "src" / Path(*waiting.pop().split("."))
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if path in found or not path.exists():
            continue
        found.add(path)
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            waiting.extend(name for name in names if name.startswith("odisar"))
    return found


def test_the_pipeline_has_the_stages_of_the_code_in_order():
    assert tuple(PIPELINE) == STAGES


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_declares_every_file_it_imports(stage):
    declared = [ROOT / dep for dep in PIPELINE[stage]["deps"]]
    missing = [
        str(path.relative_to(ROOT))
        for path in imported_files(f"odisar.stages.{stage}")
        if path.name not in PLUMBING
        and not path.is_relative_to(TRACKING)
        and not any(path.is_relative_to(dep) for dep in declared)
    ]
    assert missing == []


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_declares_no_code_it_does_not_import(stage):
    imported = imported_files(f"odisar.stages.{stage}")
    unused = [
        dep
        for dep in PIPELINE[stage]["deps"]
        if dep.startswith("src/") and not any(p.is_relative_to(ROOT / dep) for p in imported)
    ]
    assert unused == []


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_declares_the_parameters_it_may_read(stage):
    module = importlib.import_module(f"odisar.stages.{stage}")
    assert tuple(PIPELINE[stage]["params"]) == module.PARAMS


def test_what_a_stage_reads_another_makes_or_git_and_dvc_keep():
    made = {"data"}
    for stage in PIPELINE.values():
        for dep in stage["deps"]:
            kept = dep.startswith(("src/", "notebooks"))
            assert kept or any(Path(dep).is_relative_to(out) for out in made), dep
        for out in [*stage.get("outs", []), *stage.get("metrics", [])]:
            made.add(out if isinstance(out, str) else next(iter(out)))
