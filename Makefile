# ODiSAR: `make repro` and `make test` are all a newcomer needs; `make help` lists the rest.

# The first Python on the path that fits; say `make PYTHON=/path/to/python3.12 ...` for another.
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' 2>/dev/null \
	&& { echo $$p; break; }; done)
# Where a CPU build of torch is offered; for a GPU build see the README.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu
TORCH := $(shell sed -n 's/^torch==/torch==/p' constraints.txt)

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
STUDY_INSTALLED := $(VENV)/.study-installed
ODISAR := $(BIN)/python -m odisar
export PATH := $(CURDIR)/$(BIN):$(PATH)
export PYTHONPATH := $(CURDIR)/src
# Ours and DVC's lines in the order they happen, in a log as well.
export PYTHONUNBUFFERED := 1
unexport VIRTUAL_ENV

.DEFAULT_GOAL := help
.PHONY: help setup data accept-data repro smoke study-setup study real report ui lab test check format clean

help:  ## List the targets
	@echo "ODiSAR targets:"
	@sed -n 's/^\([a-z-]*\):.*##\(.*\)/  \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{printf "%-16s%s\n", $$1, $$2}'

setup: $(INSTALLED)  ## Create .venv with pinned dependencies

$(INSTALLED): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "No Python 3.11, 3.12 or 3.13 found; install one, or say make PYTHON=/path/to/python3.12"; exit 1; }
	@echo "Setting up $(VENV) with $$($(PYTHON) --version) (a few minutes the first time) ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip show --quiet torch 2>/dev/null || \
		$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --retries 1 --extra-index-url $(TORCH_INDEX) "$(TORCH)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[dev]"
	@$(BIN)/python -c 'import torch; print("torch", torch.__version__, "- GPU:", torch.cuda.is_available())'
	@touch $(INSTALLED)

$(STUDY_INSTALLED): $(INSTALLED) pyproject.toml constraints.txt
	@echo "Installing what the study needs besides ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[dev,study]"
	@touch $(STUDY_INSTALLED)

data: $(INSTALLED)  ## Make the recordings and check them against data.dvc
	@$(ODISAR) data

accept-data: $(INSTALLED)  ## Accept the recordings in data/ as they are (rewrites data.dvc)
	@$(ODISAR) data --accept

repro: $(INSTALLED)  ## Recordings, whole pipeline, result table, report
	@$(ODISAR) repro

smoke: $(INSTALLED)  ## The whole pipeline on a small profile, in workspaces/smoke
	@$(ODISAR) profile smoke

study-setup: $(STUDY_INSTALLED)  ## Install what the study's alternatives need besides

study: $(STUDY_INSTALLED)  ## After `make repro`: all alternatives, seeds, forecasts (three quarters of an hour)
	@$(BIN)/python -m dvc repro study/dvc.yaml
	@# The report takes the study in where there is one, so it can't depend on it.
	@$(BIN)/python -m dvc repro --single-item --force report
	@$(ODISAR) report

real: $(INSTALLED)  ## The same pipeline on real recordings, in workspaces/real
	@$(ODISAR) profile real

report: $(INSTALLED)  ## Execute the notebooks and write reports/report.html
	@$(ODISAR) report

ui: $(INSTALLED)  ## Browse runs in MLflow on http://127.0.0.1:5000
	@$(ODISAR) init-store
	@MLFLOW_SERVER_ENABLE_JOB_EXECUTION=false $(BIN)/mlflow server --host 127.0.0.1 --port 5000 --workers 1 \
		--backend-store-uri "sqlite:///$(CURDIR)/mlflow.db" --artifacts-destination "$(CURDIR)/mlartifacts"

lab: $(INSTALLED)  ## Open the notebooks in JupyterLab on loopback
	@$(BIN)/jupyter lab --ip 127.0.0.1 $(if $(filter 0,$(shell id -u)),--allow-root) notebooks

test: $(INSTALLED)  ## Run the whole test suite
	@# A file's tests share costly fixtures: they stay in one process.
	@$(BIN)/python -m pytest -n auto --maxprocesses 4 --dist loadfile

check: $(INSTALLED)  ## Format, lint, types, import rules, tests
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/nbstripout --verify notebooks/*.ipynb
	@$(MAKE) --no-print-directory test

format: $(INSTALLED)  ## Format code, strip notebooks
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .
	@$(BIN)/nbstripout notebooks/*.ipynb

clean:  ## Remove build/, workspaces/ and the report; data/, MLflow runs and .venv stay
	rm -rf build workspaces reports/report.html
