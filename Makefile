# Everything below needs only make and Python >= 3.11; .venv is made on demand.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
HWID := $(BIN)/hwid
# The experiments of the thesis share what they have computed.
THESIS := --cache results/cache
# Each file marks when an installation was made.
RUN := $(VENV)/installed-run
DEV := $(VENV)/installed-dev

# Modules that were compiled are kept, also where the environment says otherwise: each
# start of Python would compile them again.
unexport PYTHONDONTWRITEBYTECODE

# make run LOCKED=yes, make test LOCKED=yes: the versions and checksums of tools/locks/, nothing else.
LOCKS := tools/locks
PLATFORM ?= linux-x86_64-py311
LOCKED_INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement

.DEFAULT_GOAL := help
.PHONY: help install run test test-thorough test-all check audit format smoke clean reliability \
        bench bench-beyond bench-campaign bench-growth bench-maps bench-page bench-rounds bench-search bench-size bench-starts bench-wide bench-advice docs \
        bench-real bench-trust bench-next bench-repeats scale \
        wheel lowest away-run lock sbom licences simulate calibrate identify crossval group test-stage steps model1 model2 \
        reproduction thesis chapter2 hsm150 diagnose gun real effects drive-source model-schema golden export-check laws blind machines folders

help:  ## show these targets
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / {printf "  make %-14s %s\n", $$1, $$2}' Makefile

$(RUN): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "$(PYTHON) is older than Python 3.11 or missing; name a newer one:" \
	       "make PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
ifdef LOCKED
	$(LOCKED_INSTALL) $(LOCKS)/run-$(PLATFORM).txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
else
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
endif
	@echo "compiling the loops, once: about a minute"
	$(HWID) run configs/smoke.yaml --out $(VENV)/compiled --quiet
	@touch $@

# pip knows dependency groups since 25.1.
$(DEV): $(RUN)
ifdef LOCKED
	$(LOCKED_INSTALL) $(LOCKS)/test-$(PLATFORM).txt
else
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group dev
endif
	@touch $@

install: $(DEV)  ## make .venv with everything that tests and checks need

run: $(RUN)  ## the main job on the virtual gun: raw measurements in, tables out
	$(HWID) run configs/demo.yaml

test: $(DEV)  ## fast tests, below 90 s on two cores
	$(BIN)/python -m pytest --quiet --numprocesses auto --dist worksteal

test-thorough: $(DEV)  ## tests that take a fifth of a second or more: eight minutes on two cores
	$(BIN)/python -m pytest --quiet --numprocesses auto --dist worksteal -m 'thorough and not slow and not browser'

test-all: $(DEV)  ## all tests, also the slow ones
	$(BIN)/python -m pytest --quiet --numprocesses auto --dist worksteal -m ''

reliability: $(DEV)  ## kills, full disks, torn files, errors at every write: half an hour
	$(BIN)/python -m pytest --quiet -s -m '' tests/reliability

check: $(DEV)  ## lint, format, types, import contracts
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

# Of what is installed, and of the lowest versions that pyproject.toml allows. Asks a
# public list of known faults over the network, so it is no part of the tests.
audit: $(DEV)  ## known faults of installed packages and of the lowest allowed versions
	$(BIN)/python -m pip install --quiet --disable-pip-version-check pip-audit
	$(BIN)/pip-audit --local --skip-editable
	$(BIN)/python -c 'import tomllib; project = tomllib.load(open("pyproject.toml", "rb")); \
	  print(*(one.replace(">=", "==") for one in project["project"]["dependencies"]), sep="\n")' \
	  > $(VENV)/lowest.txt
	$(BIN)/pip-audit --no-deps --disable-pip --requirement $(VENV)/lowest.txt

# Each in an environment of its own, away from the sources: what is missing in the wheel
# shows. PYTHON names another version: make wheel PYTHON=python3.13.
AWAY := $(VENV)/away
wheel: $(RUN)  ## build the wheel, install it without the sources and run a campaign with it
	rm -rf dist $(AWAY) && $(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	$(PYTHON) -m venv $(AWAY) && $(AWAY)/bin/python -m pip install --quiet --disable-pip-version-check dist/*.whl
	@$(MAKE) --no-print-directory away-run

lowest: $(RUN)  ## the same with the lowest versions that pyproject.toml allows (Python 3.11)
	rm -rf dist $(AWAY) && $(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	$(BIN)/python -c 'import tomllib; project = tomllib.load(open("pyproject.toml", "rb")); \
	  print(*(one.replace(">=", "==") for one in project["project"]["dependencies"]), sep="\n")' \
	  > $(VENV)/lowest.txt
	$(PYTHON) -m venv $(AWAY) && $(AWAY)/bin/python -m pip install --quiet --disable-pip-version-check \
	  --requirement $(VENV)/lowest.txt
	$(AWAY)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps dist/*.whl
	@$(MAKE) --no-print-directory away-run

away-run:
	cp configs/smoke.yaml $(AWAY)/ && cd $(AWAY) && bin/python -P -m hwid_cli run smoke.yaml --out results --jobs 1
	cd $(AWAY) && bin/python -P -c 'import hwid_cli; assert "site-packages" in hwid_cli.__file__, hwid_cli.__file__'

# Asks the index for what is newest and allowed; look at the difference before it is kept.
lock: $(RUN)  ## tools/locks/: versions and checksums of everything that run and test install here
	mkdir -p $(LOCKS)
	$(BIN)/python -c 'import tomllib; project = tomllib.load(open("pyproject.toml", "rb")); \
	  print(*project["project"]["dependencies"], *project["build-system"]["requires"], "editables", sep="\n")' \
	  > $(VENV)/lock.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --dry-run --ignore-installed --report $(VENV)/run.json -r $(VENV)/lock.txt
	$(BIN)/python -m pip install --quiet --dry-run --ignore-installed --report $(VENV)/test.json -r $(VENV)/lock.txt --group dev
	$(BIN)/python tools/lock.py $(VENV)/run.json > $(LOCKS)/run-$(PLATFORM).txt
	$(BIN)/python tools/lock.py $(VENV)/test.json > $(LOCKS)/test-$(PLATFORM).txt

sbom: $(RUN)  ## what is installed, as a CycloneDX document: sbom.json
	$(PYTHON) -m venv $(VENV)/sbom
	$(VENV)/sbom/bin/python -m pip install --quiet --disable-pip-version-check 'cyclonedx-bom>=7'
	$(VENV)/sbom/bin/cyclonedx-py environment --output-reproducible --pyproject pyproject.toml --of JSON -o sbom.json $(BIN)/python

licences: $(DEV)  ## docs/licences.md from what is installed
	$(BIN)/python tools/licences.py > docs/licences.tmp && mv docs/licences.tmp docs/licences.md

format: $(DEV)  ## format the code
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

smoke: $(DEV)  ## every stage on tiny recordings, twice
	$(BIN)/python tests/smoke.py

# As modules, from here, so that they find each other; one thread of linear algebra.
BENCH := OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.benchmarks
bench: $(DEV)  ## speed and accuracy against what a user would write: about five minutes
	@for name in fit grid warm_start limit integrators first_outliers joint growth startup; do $(BENCH).bench_$$name || exit 1; done

bench-campaign: $(DEV)  ## 15 recordings with 100 orders each from an empty cache
	@$(BENCH).bench_campaign

bench-growth: $(DEV)  ## how a fit's time grows, up to 100 000 samples
	@$(BENCH).bench_growth --full

bench-rounds: $(DEV)  ## in which rounds of a grid a search anew pays: three minutes
	@$(BENCH).bench_rounds

bench-starts: $(DEV)  ## the search without each of its parts in turn: two minutes
	@$(BENCH).bench_starts

bench-search: $(DEV)  ## the whole search for groups of the thesis: half an hour
	@$(BENCH).bench_search

bench-beyond: $(DEV)  ## how far models hold beyond the recording of their fit: ten minutes
	@$(BENCH).bench_beyond

bench-advice: $(DEV)  ## recommended orders and maps against the best ones on fresh recordings: three minutes
	@$(BENCH).bench_advice

bench-maps: $(DEV)  ## maps of the default size against maps chosen by the data: seven minutes
	@$(BENCH).bench_maps

bench-page: $(DEV)  ## the page of 43 recordings: seconds, bytes, first paint: two minutes
	@$(BENCH).bench_page

bench-wide: $(DEV)  ## many kinds of plants against fits that start at the true parameters
	@$(BENCH).bench_wide

bench-size: $(DEV)  ## a folder of 10 000 recordings of which two are identified: two minutes
	@$(BENCH).bench_size

scale: $(DEV)  ## what a cluster costs, and docs/scale.md
	@$(BENCH).bench_dask --json docs/scale.json
	$(BIN)/python tools/scale.py docs/scale.json > docs/scale.tmp && mv docs/scale.tmp docs/scale.md

bench-trust: $(DEV)  ## coverage and width of bands on random plants, measurements and the gun: four minutes of processor time
	@$(BENCH).bench_trust

bench-next: $(DEV)  ## recordings needed, chosen by hwid next and by chance: half an hour
	@$(BENCH).bench_next

bench-repeats: $(DEV)  ## does hwid next find that repeats differ: three minutes
	@$(BENCH).bench_repeats

bench-real: $(DEV)  ## public benchmarks beside the published errors (data in HWID_REALDATA)
	@$(BENCH).bench_real

simulate: $(RUN)  ## stage: virtual measurements of the gun
	$(HWID) simulate configs/thesis.yaml $(THESIS)

calibrate: $(RUN)  ## stage: calibrate them
	$(HWID) calibrate configs/thesis.yaml $(THESIS)

identify: $(RUN)  ## stage: models for every recording and every order
	$(HWID) identify configs/thesis.yaml $(THESIS)

crossval: $(RUN)  ## stage: every model on every recording
	$(HWID) crossval configs/thesis.yaml $(THESIS)

group: $(RUN)  ## stage: the search for groups of steps
	$(HWID) group configs/model1.yaml $(THESIS)

test-stage: $(RUN)  ## stage: final test of the groups on recordings that nothing else used (make test runs the tests)
	$(HWID) test configs/model1.yaml $(THESIS)

steps: $(RUN)  ## section 3.2 of the thesis: models of the 15 steps on the 15 steps
	$(HWID) run configs/thesis_steps.yaml $(THESIS)

model1: $(RUN)  ## sections 3.3 and 3.4.1: groups of steps, on all 38 recordings
	$(HWID) run configs/model1.yaml $(THESIS)

model2: $(RUN)  ## section 3.4.2: groups of steps and sines, on all 38 recordings
	$(HWID) run configs/model2.yaml $(THESIS)

reproduction: $(RUN)  ## docs/reproduction.md from the results of steps, model1 and model2
	$(BIN)/python tools/reproduction.py results/thesis_steps/results.h5 results/model1/results.h5 \
	  results/model2/results.h5 > docs/reproduction.tmp && mv docs/reproduction.tmp docs/reproduction.md

thesis: chapter2 steps model1 model2  ## everything of the thesis at full size, and all 43 recordings
	$(HWID) run configs/thesis.yaml $(THESIS)
	$(MAKE) reproduction

chapter2: $(RUN)  ## all stages on the simulated servo
	$(HWID) run configs/chapter2.yaml

diagnose: $(RUN)  ## what a mass-spring-damper lacks to be the virtual gun
	$(HWID) diagnose configs/diagnose_demo.yaml

gun: $(RUN)  ## the same at full size, and docs/gun_diagnosis.md
	$(HWID) diagnose configs/diagnose_gun.yaml
	$(BIN)/python tools/gun_diagnosis.py results/diagnose_gun > docs/gun_diagnosis.tmp && mv docs/gun_diagnosis.tmp docs/gun_diagnosis.md

REAL := emps silverbox hsm150 ffwheel shaking_table pick_place rack_drive
real: $(RUN)  ## diagnose real machines (data in HWID_REALDATA), and docs/real_diagnosis.md
	@for name in $(REAL); do $(HWID) diagnose configs/diagnose_$$name.yaml || exit 1; done
	$(BIN)/python tools/real_diagnosis.py results > docs/real_diagnosis.tmp && mv docs/real_diagnosis.tmp docs/real_diagnosis.md

docs: $(DEV)  ## the documents as a site: results/site/index.html
	$(BIN)/mkdocs build --quiet --config-file tools/mkdocs.yml

effects: $(RUN)  ## docs/effects.md from the catalogue
	$(BIN)/python tools/effects_document.py

drive-source: $(RUN)  ## the C form of the drive's compiled loops, for hwid export
	$(BIN)/python tools/drive_source.py

# Real recordings are read from HWID_REALDATA where it is set.
BASE ?= HEAD
PARTS ?= smoke demo diagnose_demo
golden: $(DEV)  ## the same numbers as at a commit, bit by bit? make golden BASE=HEAD~3
	rm -rf results/golden && git worktree prune && git worktree add --quiet --detach results/golden/base $(BASE)
	$(BIN)/python tools/golden.py record results/golden/base results/golden/old.json $(PARTS)
	$(BIN)/python tools/golden.py record . results/golden/new.json $(PARTS)
	git worktree remove --force results/golden/base
	$(BIN)/python tools/golden.py compare results/golden/old.json results/golden/new.json

model-schema: $(RUN)  ## what the kinds of static map say, in the JSON Schema of exported models
	$(BIN)/python tools/model_schema.py

export-check: $(DEV)  ## every format of hwid export against hwid predict: the table of docs/export.md
	$(BIN)/python -m tests.benchmarks.export_check

# The seconds in the document are valid only on a machine that does nothing else.
BLIND ?= results/blind
BLIND_NUMBER ?= 1
laws: $(DEV)  ## hidden laws outside the catalogue, beside pysindy and pyoperon: half an hour
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group peers
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -W ignore -m tests.laws.run_laws --write results/laws_measured.md

blind: $(DEV)  ## blind test with effects hidden by a separate generator, and docs/blind_test.md: an hour and more
	$(BIN)/python tests/blind/run_blind.py --suite full --suite poor --suite clean --suite nuisance \
	  --suite outside --suite near --suite pairs --suite small --seeds reporting \
	  --number $(BLIND_NUMBER) --jobs 2 --work $(BLIND) --write docs/blind_test.md

folders: $(DEV)  ## models of folders of recordings, judged on recordings that come later: five minutes
	$(BIN)/python -m tests.folders.run_folders --work results/folders

# Independent equations and integrators. Each of the seeds for reports is for one of them.
MACHINE_SEEDS := sixth_reporting
machines: $(DEV)  ## diagnosis of machines of independent making, and a simple peer on the same: an hour
	$(BIN)/python -m tests.machines.run_machines --seeds $(MACHINE_SEEDS) --jobs 2 \
	  --work results/machines --write results/machines/table.md
	$(BIN)/python -m tests.machines.peer --seeds $(MACHINE_SEEDS) \
	  --work results/machines --write results/machines/peer.md

hsm150: $(RUN)  ## all stages on measurements of a real servo motor, and linear models of them
	$(HWID) run configs/hsm150_linear.yaml
	$(HWID) run configs/hsm150.yaml

clean:  ## remove .venv and caches; results stay
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find hwid_cli tests -name __pycache__ -type d -prune -exec rm -rf {} +
