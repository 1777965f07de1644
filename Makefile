# make demo   installs the environment and computes a Bode plot of the flexible robot from co-simulated FMUs
# make test   installs the environment and runs the tests
# make bench  speed and error of our stepping loop and of other masters, of sweeps;  make published  published numbers
# make extremes  what was tried at the extremes, and how it ended, into docs/extremes.md (ARGS=--long: 1e9 steps)
# make slow   tests that take minutes;  make fuzz  tests with new random examples;  make coverage  code without tests
# make style  format, rules and floors;  make lint  types as well;  make docs  the site;  make pictures  its pictures
# make torture  what is done to hfsa on purpose, and how often it held: docs/torture.md (ARGS="--seed 7 kills")
# make trades the cheapest way to run each of some scenes: docs/trades.md
# make elsewhere  our FMUs in tools of others, each in an environment of its own: docs/tools.md
# make lock   new pinned versions

.DELETE_ON_ERROR:
.PHONY: demo test slow fuzz coverage bench published extremes torture style lint docs pictures trades elsewhere lock clean

PYTHON ?= python3
# tests run in one process per core: threads of linear algebra would wait for each other
export OPENBLAS_NUM_THREADS ?= 1
BIN := .venv/bin
HAS_UV := $(shell command -v uv 2> /dev/null)
HAS_CC := $(shell command -v $${CC:-cc} 2> /dev/null || command -v gcc 2> /dev/null || command -v clang 2> /dev/null)
VERTICAL := --input command.position[3] --signal platform.position[3] --from 1 --to 50 --points 40
LOCKS := requirements.lock $(if $(HAS_CC),,requirements-zig.lock)

demo: .venv/installed
	$(BIN)/hfsa sweep sdelta_shaker $(VERTICAL) -o results/demo.h5 --force
	$(BIN)/hfsa sweep sdelta_hfsa $(VERTICAL) -o results/demo_hfsa.h5 --force
	$(BIN)/hfsa bode results/demo.h5 results/demo_hfsa.h5 -o results/demo.png

test: .venv/installed
	$(BIN)/python -m pytest -m "not slow" -n auto --maxprocesses 8

slow: .venv/installed
	$(BIN)/python -m pytest -m slow -n auto --maxprocesses 8

# Each round draws new examples; a failure prints its example and stores it in `.hypothesis`.
ROUNDS ?= 5
fuzz: .venv/installed
	for round in $$(seq $(ROUNDS)); do \
		$(BIN)/python -m pytest -m "hypothesis and not slow" --hypothesis-profile=fuzz --timeout=0 -q -n auto --maxprocesses 8 || exit 1; \
	done

coverage: .venv/installed
	$(BIN)/python -m pytest -m "not slow" -n auto --maxprocesses 8 --cov --cov-report=term --cov-report=html

bench: .venv/installed
	$(BIN)/python tests/benchmarks/masters.py
	$(BIN)/python tests/benchmarks/isolation.py
	$(BIN)/python tests/benchmarks/sweeps.py
	$(BIN)/python tests/benchmarks/work_precision.py

published: .venv/installed
	$(BIN)/python tests/published.py

extremes: .venv/installed
	$(BIN)/python docs/extremes.py $(ARGS)

torture: .venv/installed
	PYTHONPATH=tests $(BIN)/python -m torture $(ARGS)

style: .venv/installed
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports

lint: style
	$(BIN)/pyright

docs: .venv/installed
	$(BIN)/sphinx-build -W --keep-going --quiet -b html docs docs/_build
	$(BIN)/python docs/links.py docs/_build

pictures: .venv/installed
	$(BIN)/python docs/pictures.py

trades: .venv/installed
	$(BIN)/python docs/trades.py

elsewhere: .venv/installed
	$(BIN)/python tests/elsewhere/run.py $(ARGS)

# Environment: pinned versions with hashes, then this checkout, editable.
.venv/installed: $(LOCKS) pyproject.toml setup.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "hfsa needs Python 3.11 or newer; set PYTHON=...")'
ifdef HAS_UV
	@echo "setting up .venv from requirements.lock by uv: some seconds, more where packages are downloaded"
	test -x $(BIN)/python || uv venv --quiet --python $(PYTHON) .venv
	uv pip install --quiet --python $(BIN)/python --require-hashes $(LOCKS:%=-r %)
	uv pip install --quiet --python $(BIN)/python --no-build-isolation --no-deps --editable .
else
	@echo "setting up .venv from requirements.lock by pip: a minute or two, more where packages are downloaded"
	test -x $(BIN)/python -a -x $(BIN)/pip || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --require-hashes $(LOCKS:%=-r %)
	$(BIN)/python -m pip install --quiet --no-build-isolation --no-deps --editable .
endif
	touch $@
	@echo "set up: $$($(BIN)/python -c 'import importlib.metadata as m; print("hfsa", m.version("hfsa"))') in .venv; $(BIN)/hfsa --help lists the commands"

lock:
	uv pip compile --quiet --universal --generate-hashes --no-emit-index-url --python-version 3.11 \
		--extra analysis --group dev pyproject.toml -o requirements.lock
	echo ziglang | uv pip compile --quiet --universal --generate-hashes --no-emit-index-url --python-version 3.11 - -o requirements-zig.lock

clean:
	rm -rf .venv build fmus/built docs/_build docs/_generated docs/reference cosim/masters/native/_step_*
