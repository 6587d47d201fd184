"""study/dvc.yaml against the study's code and params.yaml: what a part needs, its stage says."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from odisar.study.runner import PARTS

ROOT = Path(__file__).resolve().parent.parent.parent
STUDY = YAML(typ="safe").load((ROOT / "study/dvc.yaml").read_text())
STAGES = STUDY["stages"]
SETUPS = YAML(typ="safe").load((ROOT / "params.yaml").read_text())["study"]["setups"]
ALTERNATIVES = re.compile(r"build/study/alternatives-([^$]+)\.json")
#: A view answers these whatever sections it has.
ALWAYS_KNOWN = {"case_of", "active_cases", "active_simulators", "recipe_of"}


def part(name):
    """Return the module that runs a part."""
    return importlib.import_module(f"odisar.study.{name}")


def outs(stage):
    """Return the paths that a stage makes."""
    return [out if isinstance(out, str) else next(iter(out)) for out in STAGES[stage]["outs"]]


def named_setups(stage):
    """Return the set-ups whose alternatives a stage reads by name."""
    found = (ALTERNATIVES.fullmatch(dep) for dep in STAGES[stage]["deps"])
    return [match[1] for match in found if match]


def test_every_part_has_a_stage_and_every_stage_a_part():
    assert set(STAGES) == set(PARTS)
    assert len(set(PARTS)) == len(PARTS)


@pytest.mark.parametrize("name", PARTS)
def test_a_stage_declares_the_parameters_its_part_may_read(name):
    assert tuple(STAGES[name]["params"]) == part(name).PARAMS


@pytest.mark.parametrize("name", PARTS)
def test_a_part_reads_no_section_it_does_not_declare(name):
    tree = ast.parse(Path(part(name).__file__).read_text())
    read = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "config"
    }
    assert read - ALWAYS_KNOWN <= set(part(name).PARAMS)


@pytest.mark.parametrize("name", PARTS)
def test_a_stage_runs_its_part_and_names_a_set_up_only_where_the_part_takes_one(name):
    stage = STAGES[name]
    takes_a_setup = "setup" in inspect.signature(part(name).run).parameters
    assert stage.get("matrix") == ({"setup": "${study.setups}"} if takes_a_setup else None)
    words = stage["cmd"].partition(" study ")[2].split()
    assert words == ([name, "${item.setup}"] if takes_a_setup else [name])
    assert all(("${item.setup}" in out) == takes_a_setup for out in outs(name))


@pytest.mark.parametrize("name", PARTS)
def test_the_code_a_stage_depends_on_exists(name):
    code = [dep for dep in STAGES[name]["deps"] if dep.startswith("src/")]
    assert code
    assert [dep for dep in code if not (ROOT / dep).exists()] == []


@pytest.mark.parametrize("name", PARTS)
def test_a_stage_writes_into_the_studys_folders(name):
    assert outs(name)
    folders = {str(Path(out).parent) for out in outs(name)}
    assert folders <= {"reports/study", "build/study"}


def test_no_two_stages_write_the_same():
    every = [out for name in STAGES for out in outs(name)]
    assert len(set(every)) == len(every)


@pytest.mark.parametrize("name", PARTS)
def test_the_set_ups_whose_alternatives_are_read_are_those_of_the_study(name):
    named = named_setups(name)
    assert named == (SETUPS if named else [])


def test_what_compares_reads_the_alternatives_of_every_set_up():
    assert named_setups("comparing") == SETUPS
    assert outs("alternatives") == ["build/study/alternatives-${item.setup}.json"]
