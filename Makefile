# `make results` and `make test` set up .venv from the lock by themselves; nothing else is needed than Python >= 3.11 and make.
PYTHON ?= python3
CORES ?= 2
BIN = .venv/bin

.PHONY: results report compare check-data test test-slurm bench docs lint lock

results: .venv/ready
	@$(BIN)/snakemake --unlock >/dev/null 2>&1 || true
	$(BIN)/snakemake --cores $(CORES)

# one page of everything, results/report.html
report: .venv/ready
	@$(BIN)/snakemake --unlock >/dev/null 2>&1 || true
	$(BIN)/snakemake --cores $(CORES) report

# two folders of results, or two campaigns of results: make compare A=field_01 B=field_09
compare: .venv/ready
	@$(BIN)/rrru compare "$(A)" "$(B)" --page results/compare.html

# what is in a file of measurements: make check-data FILE=tracker.csv ROBOT=rrru3 [COMMANDS=commands.csv] [CONFIG=mine.yaml]
check-data: .venv/ready
	$(if $(FILE),,$(error say which file: make check-data FILE=tracker.csv ROBOT=rrru3))
	@$(BIN)/rrru check "$(FILE)" $(if $(ROBOT),--robot "$(ROBOT)") \
	  $(if $(COMMANDS),--commands "$(COMMANDS)") --config config.yaml $(CONFIG)

test: .venv/ready
	$(BIN)/python -m pytest

# a study through a Slurm of one node, which it starts and ends; some minutes
test-slurm: .venv/ready
	RRRU_SLURM=1 $(BIN)/python -m pytest -n 0 -rs tests/workflow/test_slurm.py

# beside what a user would use instead, docs/benchmarks.md: make bench [GROUPS="objective genetic"]
bench: .venv-bench/ready
	.venv-bench/bin/python -m benchmarks $(GROUPS)

# the site, site/index.html; a broken link ends it (not with --quiet, which takes the warnings away that --strict counts)
docs: .venv-docs/ready
	.venv-docs/bin/mkdocs build --strict

lint: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow/rules
	$(BIN)/mypy
	-$(BIN)/snakemake --lint # asks for conda environments; the environment is .venv, see README

.venv/ready: requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, this is " + sys.version)'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

# the lock names all that is needed; that pybotics asks for an older NumPy is overridden there
.venv-bench/ready: benchmarks/requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv-bench
	.venv-bench/bin/python -m pip install --quiet --no-deps --require-hashes -r benchmarks/requirements.lock
	.venv-bench/bin/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

# it reads the package's sources and imports none of it
.venv-docs/ready: docs/requirements.lock
	$(PYTHON) -m venv .venv-docs
	.venv-docs/bin/python -m pip install --quiet --require-hashes -r docs/requirements.lock
	touch $@

# needs uv; run after changing a requirements.in
COMPILE = uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --no-annotate
lock:
	$(COMPILE) requirements.in -o requirements.lock
	$(COMPILE) benchmarks/requirements.in --override benchmarks/overrides.txt -o benchmarks/requirements.lock
	$(COMPILE) docs/requirements.in -o docs/requirements.lock
