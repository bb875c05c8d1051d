# Everything from a bare machine: `make study` and `make test` need only make and Python 3.11 or newer.
# Commands and paths are relative to this folder, which may have spaces in its name.

BIN := .venv/bin
STUDY := austin2015
OUT := out/$(STUDY)
WORKERS := 2
# Kernels of OpenBLAS that x86-64 processors with AVX2 can run.
KERNELS := Haswell Prescott Zen
PLACES := nlsdesign/model nlsdesign/feedback/observer nlsdesign/bench/discrepancy nlsdesign/export
MUTANTS := 200
SEED := 1
# A file of tests goes to one worker, so that what its tests share is made once; in the order of the folders, where
# the long files stand in the middle, and not by the number of tests, which would begin the longest last.
SHARED_OUT := --dist loadfile --no-loadscope-reorder
UV := uv==0.13.8

# One thread for each worker: two workers on two cores are slower, not faster, when BLAS starts four threads.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
# The environment is installed without bytecode, and tests and commands start hundreds of processes: where none may be
# written, each compiles NumPy, SciPy, SymPy and this package anew, which takes several times as long as loading them.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help study test thorough tutorial kernels mutation lint style types bench masters targets proofs firmware wheels docs paper gallery environment lock clean distclean

help:
	@echo 'make study      a small study, then that of the published actuator; the report goes to $(OUT)/report.html'
	@echo '                (another one: make study STUDY=name; another folder: make study OUT=folder)'
	@echo 'make test       style, types and all tests but the slow ones'
	@echo 'make thorough   the slow tests and the documentation site too, before a release'
	@echo 'make kernels    the tests under several kernels of linear algebra: same results on every processor'
	@echo 'make mutation   break the package in places drawn by chance and list what no test notices'
	@echo 'make lint       style and types only'
	@echo 'make bench      the benchmarks: ratios against named peers, docs/benchmarks.md'
	@echo 'make docs       the documentation site, into out/docs; warnings and dead links are errors'
	@echo 'make paper      the claimed figures of the paper of 2015, and our own paper with its pictures: out/paper'
	@echo 'make gallery    run all studies and keep some of their figures for the site (minutes)'
	@echo 'make masters    our FMUs in foreign masters: docs/fmi_masters.md'
	@echo 'make targets    generated C on processors of controllers in an emulator: docs/targets.md'
	@echo 'make firmware   the example firmware on an emulated board against the FMU of its machine: docs/firmware.md'
	@echo 'make proofs     what is proved of generated C for all inputs: docs/proofs.md (needs frama-c)'
	@echo 'make tutorial   run the tutorial and write its numbers, figures and notebook anew'
	@echo 'make wheels     build wheel and sdist, install and try each on every Python that is here'
	@echo 'make lock       write requirements/*.txt anew (newest versions: make lock UPGRADE=--upgrade)'
	@echo 'make clean      remove what study, test and build have written'
	@echo 'make distclean  remove .venv too'
	@echo 'All but lock and clean make .venv first where it is missing or out of date;'
	@echo 'PYTHON=/path/to/python chooses the interpreter for it.'

environment:
	@PYTHON='$(PYTHON)' $(SHELL) requirements/environment.sh

# A study needs a part of the packages only. In front of the long one stands the smallest, a result within seconds.
study:
	@PYTHON='$(PYTHON)' $(SHELL) requirements/environment.sh study
ifeq ($(STUDY),austin2015)
	@$(BIN)/nlsdesign study run hello --out out/hello
endif
	@$(BIN)/nlsdesign study run '$(STUDY)' --out '$(OUT)'

style: environment
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: environment
	$(BIN)/pyrefly check --python-interpreter-path $(BIN)/python --min-severity error --summary=none

lint: style types

# To rewrite assertions so that they show their numbers takes a quarter minute of each worker, so only those that fail
# are run again with it; the run has failed all the same.
# Types are checked beside the first tests, so that no core waits.
test: style
	@$(MAKE) --no-print-directory types & types=$$!; \
	$(BIN)/python -m pytest -n $(WORKERS) $(SHARED_OUT) -m 'not slow' --assert plain || { status=$$?; \
		[ $$status -ne 1 ] || $(BIN)/python -m pytest -m 'not slow' --last-failed --last-failed-no-failures none; \
		exit $$status; }; \
	wait $$types

# A second checker of types takes five times as long and finds next to nothing that the first one passed.
thorough: lint docs
	$(BIN)/mypy --strict nlsdesign models studies
	$(BIN)/python -m pytest -n $(WORKERS) $(SHARED_OUT)

kernels: environment
	@for kernel in $(KERNELS); do \
		echo "OpenBLAS kernel $$kernel"; \
		OPENBLAS_CORETYPE=$$kernel $(BIN)/python -m pytest -q -n $(WORKERS) $(SHARED_OUT) -m 'not slow' || exit 1; \
	done

mutation: environment
	$(BIN)/python -m pip install --quiet 'cosmic-ray>=8.4' 'coverage>=7.6'
	$(BIN)/python -m tests.mutation $(PLACES) --count $(MUTANTS) --seed $(SEED)

bench: environment
	$(BIN)/python -m benchmarks

docs: environment
	$(BIN)/python -m docs.site out/docs --jobs $(WORKERS)

paper: environment
	$(BIN)/python -m docs.site.paper out/paper

gallery: environment
	$(BIN)/python -m docs.site.collect

masters: environment
	$(BIN)/python -m benchmarks.foreign_masters --write docs/fmi_masters.md

tutorial: environment
	$(BIN)/python -m tests.tutorial --write

targets: environment
	$(BIN)/python -m benchmarks.targets

proofs: environment
	$(BIN)/python -m benchmarks.proofs

firmware: environment
	$(BIN)/python -m benchmarks.firmware_in_the_loop

wheels: environment
	$(BIN)/python -m tests.wheels

# Needs a network but no .venv, which a broken lock could not make. What is locked stays unless UPGRADE is given.
lock:
	'$(or $(PYTHON),python3)' -m venv .venv-lock
	.venv-lock/bin/python -m pip install --quiet '$(UV)'
	.venv-lock/bin/uv pip compile pyproject.toml \
		--extra export --extra tables --extra records --extra robots --extra modelica --extra a2l --extra scale --extra sensitivity --extra live --extra cma --extra masters --extra rigs --extra docs \
		--extra test --extra lint --group build \
		--universal --python-version 3.11 --generate-hashes --only-binary :all: \
		--custom-compile-command 'make lock' --quiet $(UPGRADE) \
		--output-file requirements/locked.txt
	.venv-lock/bin/uv pip compile pyproject.toml --extra export --group build --constraint requirements/locked.txt \
		--universal --python-version 3.11 --generate-hashes --only-binary :all: \
		--custom-compile-command 'make lock' --quiet --output-file requirements/study.txt

clean:
	rm -rf out dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find nlsdesign models studies tests benchmarks -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

distclean: clean
	rm -rf .venv .venv-lock
