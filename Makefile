# Two commands: `make run` (the simulated rig, end to end) and `make test`. Both set up .venv from the lock first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SAMPLES ?= 5
SEED ?= 1

.PHONY: run test test-alone test-system test-portable proof proof-full faults soak fuzz lint style types setup lock bench docs reference clean

run: setup
	$(BIN)/station rig --samples $(SAMPLES) --seed $(SEED)
	@echo
	@echo $(BIN)/station demo
	@$(BIN)/station demo || [ $$? = 1 ]  # 1: the effect was not named, which it says
	@echo 'Once in each terminal: . $(BIN)/activate    Then `station` and `pi-agent` are commands of it.'

# The tests with processes, sockets and clocks of their own mostly wait, so they run beside the others, three files at a
# time. The others, which compute, and the check of the types run aside (`tests/aside.py`): they take what the former
# leave of two cores, and do not disturb them. What ends first is told when it has ended, so that the outputs do not mix.
# The others, too, run three files at a time: a worker that waits for a command that its test has started leaves its core
# to another.
#
# The matrices are small: a second thread of linear algebra would mostly wait for the first, at full load, and two cores
# are busy without it. `make test-portable` runs the same tests in one thread and in two.
test test-alone test-system: export OPENBLAS_NUM_THREADS := 1

# The tests start some hundred processes. Each would compile all of it anew (1.3 s for `station diagnose`) where the
# environment asks Python to keep no bytecode, as images of containers do.
test test-alone test-system: export PYTHONDONTWRITEBYTECODE :=

test: setup
	@$(MAKE) --no-print-directory -j 2 style $(VENV)/.compiled $(VENV)/.collected
	@$(MAKE) --no-print-directory -j 3 types-told test-system-told test-alone

# What numba compiles (20 s), once beside the style: the tests begin in several processes, and each would compile it.
$(VENV)/.compiled: station/compiled.py $(wildcard station/diagnosis/*/*.py tests/concealed/*.py)
	@rm -rf $(VENV)/compiled
	@$(BIN)/python -m tests.concealed --tier null --cases 1 --seed 1 --out $(VENV)/compiled >/dev/null
	@$(BIN)/station diagnose $(VENV)/compiled/*/session.mcap --json >/dev/null
	@rm -rf $(VENV)/compiled && touch $@

# Six workers collect the tests, and each would rewrite the assertions of all modules (7 s): kept once, all read them.
$(VENV)/.collected: | $(VENV)/.ready
	@PYTHONDONTWRITEBYTECODE= $(BIN)/pytest --collect-only -q tests >/dev/null 2>&1 || true  # what fails, the tests tell
	@touch $@

test-alone: setup
	@unset MAKEFLAGS MAKELEVEL; $(BIN)/python -m tests.aside $(BIN)/pytest -n 3 --dist loadfile --no-loadscope-reorder \
	  tests --ignore=tests/system

test-system: setup
	@unset MAKEFLAGS MAKELEVEL; REPOSE_PORTS_ASIDE=4 $(BIN)/pytest -n 3 --dist loadfile --no-loadscope-reorder tests/system

%-told: setup
	@told=$$(mktemp) && { $(MAKE) --no-print-directory $* >"$$told" 2>&1; ended=$$?; cat "$$told"; rm "$$told"; exit $$ended; }

# The same tests as on other processors, in other thread counts and on a busy machine: a table of what fails where. All of
# it takes hours; e.g. make test-portable ARGS="--variant plainest tests/unit", or ARGS=--list for the variants.
test-portable: setup
	$(BIN)/python -m tests.portable $(ARGS)

# Concealed cases of every family, the tool once, then the sealed key (tests/proof/README.md): minutes, or hours that may
# be broken off and go on. PROOF is the folder of it all; figures to report come from a fresh seed and folder.
PROOF ?= proof
proof: setup
	$(BIN)/python -m tests.proof --quick --seed $(SEED) --out $(PROOF) $(ARGS)

proof-full: setup
	$(BIN)/python -m tests.proof --full --seed $(SEED) --out $(PROOF) $(ARGS)

# What faults cost: real processes on real links, every row so many times in random phases (root has cables to pull); e.g.
# make faults ARGS="--row 'kill -9' --times 5", or ARGS=--list for the rows. All of it takes about two hours for three times.
faults: setup
	$(BIN)/python -m tests.faults $(ARGS)

# A session of 20 000 samples in simulated time, watched from outside: memory, file handles, threads, as a plot, and its parts
# read as one; e.g. make soak ARGS="--samples 500 --split 50"
soak: setup
	$(BIN)/python -m tests.soak $(ARGS)

# Inputs that nobody should send, to every reader and the bus; e.g. make fuzz ARGS="--inputs 200000 --jobs 2"
fuzz: setup
	$(BIN)/python -m tests.fuzz $(ARGS)

lint: style types

style: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: setup
	$(BIN)/python -m tests.aside $(BIN)/basedpyright

setup: $(VENV)/.ready

# The stamp holds nothing: it is newer than the lock when the environment matches the lock.
$(VENV)/.ready: requirements.lock pyproject.toml
	@echo "Setting up $(VENV) from requirements.lock (3 GB; about two minutes the first time, nothing afterwards)"
	@sh deploy/prepare.sh "$(PYTHON)" "$(VENV)" requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --only-binary :all: --require-hashes \
	  -r requirements.lock
	@$(BIN)/python -m pip uninstall --quiet --yes repose 2>/dev/null || true  # what it was called before
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@$(BIN)/python -m compileall -q shared pi_agent station
	@touch $@
	@echo "Ready. The commands are $(BIN)/station and $(BIN)/pi-agent."

# Pins every dependency of every platform with its hash; needs uv, which users do not.
lock:
	uv pip compile --python-version 3.11 --universal --generate-hashes --all-extras --group dev --no-header -q \
	  pyproject.toml -o requirements.lock

# The documentation site, into build/docs/site. It runs the tutorial, which takes half a minute; the rest is not in the lock.
docs: setup
	$(BIN)/python -m docs.make guide build/docs/pages
	$(BIN)/python -m docs.make needs > build/docs/needs.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r build/docs/needs.txt
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet --config-file docs/mkdocs.yml
	@echo "The site is build/docs/site/index.html"

# The pages of the reference, from the code; a test fails while they are older.
reference: setup
	$(BIN)/python -m docs.make reference

bench: setup
	$(BIN)/pytest -m benchmark tests/benchmarks -s

clean:
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .hypothesis
