# er3a: `make run` sets up and produces the reports, `make test` sets up and passes the tests.
# Everything lives in .venv; nothing needs root.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STUDY  ?= config/config.yaml
ROBOT  ?=
ARGS   ?=

.DEFAULT_GOAL := help
# Commands take the study's path from the environment, where blanks and quotes in it mean nothing.
export STUDY
# A run starts dozens of short processes: without compiled modules kept on disk each would compile them anew.
unexport PYTHONDONTWRITEBYTECODE
# Many small matrices: threads of BLAS only wait for each other.
export OPENBLAS_NUM_THREADS ?= 1
export OMP_NUM_THREADS ?= 1
.PHONY: help run test test-all view lint format schema words lock clean distclean campaigns docs pictures release-check

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):[^#]*## /  make \1\t/' | expand -t 18

run: $(VENV)/run.stamp  ## set up, run the study, write reports/index.html (ARGS="--cores 1", STUDY=config/small.yaml)
	@$(BIN)/er3a run --study "$$STUDY" -- $(ARGS)

test: $(VENV)/dev.stamp  ## set up and run the fast tests (ARGS="-k workspace")
	@$(BIN)/python -m pytest $(ARGS)

test-all: $(VENV)/dev.stamp  ## set up and run all tests, the long ones too
	@$(UV_SETTINGS) $(BIN)/python -m pytest -m "" $(ARGS)

view: $(VENV)/run.stamp  ## open the recordings in the Rerun viewer (ROBOT=er3a_c60 for one arm)
	@$(BIN)/er3a view $(ROBOT)

lint: $(VENV)/dev.stamp  ## check format, types, imports and lint of Python and Snakemake code
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint
	$(BIN)/python -m testing.budget

format: $(VENV)/dev.stamp  ## format Python and Snakemake code
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	$(BIN)/snakefmt Snakefile workflow

schema: $(VENV)/dev.stamp  ## write the JSON schemas again from the pydantic models
	$(BIN)/python -m testing.schemas

LOCALE := er3a/pipeline/messages/locale

words: $(VENV)/dev.stamp  ## collect the texts to be translated into er3a/pipeline/messages/locale/
	$(BIN)/python -m babel.messages.frontend -q extract -F $(LOCALE)/babel.cfg -k tr --no-location --sort-by-file --omit-header \
		--width=100000 -o $(LOCALE)/er3a.pot .
	$(BIN)/pybabel -q update -D er3a -i $(LOCALE)/er3a.pot -d $(LOCALE) --width=100000 --ignore-obsolete \
		--ignore-pot-creation-date
	rm $(LOCALE)/er3a.pot

campaigns: $(VENV)/speed.stamp  ## evidence whose code has changed, again (ARGS="motion --again", ARGS="--share 0.01")
	$(BIN)/python -m benchmarks.campaigns $(ARGS)

docs: $(VENV)/docs.stamp  ## build the documentation site in docs/_build/html; warnings and broken links are errors
	@$(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html
	@$(BIN)/python -m testing.links docs/_build/html
	@echo "docs/_build/html/index.html"

pictures: $(VENV)/dev.stamp  ## pictures of the documentation again, from finished studies (config.yaml and gallery.yaml)
	$(BIN)/python -m testing.pictures playing
	$(BIN)/python -m testing.pictures arms

release-check: $(VENV)/run.stamp  ## an error unless the papers of a release agree; lists pages of evidence of other code
	@$(BIN)/python -m testing.evidence

lock: $(VENV)/uv.stamp  ## resolve the locked requirements again
	@$(UV) pip compile pyproject.toml --extra build --extra dev --extra peers $(LOCK_FLAGS) -o requirements/dev.txt
	@$(UV) pip compile pyproject.toml --extra build --extra study -c requirements/dev.txt $(LOCK_FLAGS) -o requirements/run.txt
	@$(UV) pip compile pyproject.toml --extra build --extra study --extra docs -c requirements/dev.txt $(LOCK_FLAGS) -o requirements/docs.txt
	@$(UV) pip compile pyproject.toml --extra build --extra dev --extra peers --extra speed -c requirements/dev.txt $(LOCK_FLAGS) \
		-o requirements/speed.txt
	@echo uv >$(VENV)/uv.in
	@$(UV) pip compile $(VENV)/uv.in $(LOCK_FLAGS) -o requirements/uv.txt

LOCK_FLAGS := --quiet --universal --python-version 3.11 --generate-hashes \
	--no-header --no-annotate --no-emit-index-url --no-emit-find-links

clean:  ## remove results, reports and recordings
	rm -rf results logs .snakemake docs/_build docs/generated
	find reports -mindepth 1 ! -name README.md -delete

distclean: clean  ## also remove the environment
	rm -rf $(VENV) .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis

# uv does not read what pip was told: certificate, proxy and index of pip's settings, asked for once, are handed on to it,
# unless its own variables name others; and it takes the system's certificates, as pip does.
pip_setting = $$(printf '%s' "$$told" | sed -En "s/^(global|install)\.$(1)=.(.*).$$/\2/p" | tail -n 1)
export_setting = value=$${$(1):-$${$(2):-$(call pip_setting,$(3))}}; [ -z "$$value" ] || export $(1)="$$value";
UV_SETTINGS = told=$$($(BIN)/python -m pip config list 2>/dev/null); \
	$(call export_setting,SSL_CERT_FILE,PIP_CERT,cert) $(call export_setting,HTTPS_PROXY,PIP_PROXY,proxy) \
	$(call export_setting,UV_DEFAULT_INDEX,PIP_INDEX_URL,index-url) export UV_SYSTEM_CERTS=1;
UV = $(UV_SETTINGS) $(BIN)/uv

# The environment: a venv, a hash-checked uv in it, then the hash-checked lock.
$(VENV)/uv.stamp: requirements/uv.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "er3a needs Python 3.11 or newer; $(PYTHON) is older. Name another one: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/uv.txt
	@touch $@

$(VENV)/%.stamp: requirements/%.txt pyproject.toml $(VENV)/uv.stamp
	@echo "Setting up $(VENV) from $< ..."
	@$(UV) pip install --quiet --python $(BIN)/python --require-hashes -r $< && \
		$(BIN)/uv pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation -e .
	@touch $@
