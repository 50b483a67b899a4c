# Three commands do everything on a fresh machine with Python 3.11: `make demo`, `make train` and
# `make test`.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
RUN ?= runs/first
MINUTES ?= 10
TRIALS ?= 256
SEED ?= 0
# Half of the time two shipped policies teach, half of it what they taught is trained on.
HALF := $(shell awk 'BEGIN { print $(MINUTES) / 2 }')

.PHONY: help setup demo train test check docs format proto clean
.DEFAULT_GOAL := help

help:
	@echo "make demo    set up, and open a furnished room in the browser"
	@echo "make train   set up, train sit from the shipped walker for about $(MINUTES) minutes, evaluate, and make a report, a replay and a film"
	@echo "make test    set up and run every test"
	@echo "make check   set up and check format, lint, types, direction of imports and documentation"
	@echo "make docs    build the documentation into site/; every warning is an error"
	@echo "make setup   set up the virtual environment, in .venv"

# With the stamp file set-up runs once, and again when a requirement changes.
setup: .venv/.installed

.venv/.installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; ok = (3, 11) <= sys.version_info[:2] < (3, 14); sys.exit(None if ok else "inhabit needs Python 3.11 to 3.13, this is %d.%d: make PYTHON=/path/to/python3.11 ..." % sys.version_info[:2])'
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@echo "installing into .venv (a few minutes the first time)"
	@# Without a GPU the pinned torch is installed first, so that no package pulls a CUDA build.
	@command -v nvidia-smi >/dev/null || $(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt "$$(grep '^torch==' constraints.txt)"
	@$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: setup
	$(BIN)/inhabit demo

train: setup
	@echo "Trains sit for $(MINUTES) minutes from the shipped policy that walks: half of them it learns from that policy"
	@echo "and from one that follows the package's own motions of sitting down, then it goes on by reinforcement learning;"
	@echo "then come $(TRIALS) trials on furniture that it has not seen, a report, a replay and a film: some 5 minutes more."
	$(BIN)/inhabit distill sit $(RUN)-taught --replace --init walk --world.walker walk --world.tracker track-sit \
	    --minutes $(HALF) --seed $(SEED)
	$(BIN)/inhabit train sit --run $(RUN) --restart --init $(RUN)-taught --preset finetune --minutes $(HALF) --seed $(SEED)
	$(BIN)/inhabit evaluate $(RUN) --trials $(TRIALS)
	$(BIN)/inhabit report $(RUN) --trials 24
	$(BIN)/inhabit synthesize $(RUN) --object chair-test-000 --start 3,0,180 --tries 6 --out $(RUN)/replay.html --overwrite
	$(BIN)/inhabit video $(RUN) $(RUN)/film.mp4
	@echo
	@echo "Look at: $(RUN)/report.html   results, replays, pictures, curves"
	@echo "         $(RUN)/replay.html   one trial, to turn with the mouse"
	@echo "         $(RUN)/film.mp4      four trials"
	@echo "Next:    $(BIN)/inhabit play $(RUN)      the policy in the browser: push it, move the chair"
	@echo "         $(BIN)/inhabit train sit --run $(RUN) --resume --minutes 60      more training"

test: setup
	$(BIN)/python -m pytest

check: setup docs
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/basedpyright --level error

format: setup
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# Strict: a warning (a broken link, a page outside the navigation) fails the build; --quiet would not
# count them.
docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

# Regenerates the committed stubs in rpc/v1 and the client; a test compares them.
proto: setup
	$(BIN)/python -m rpc.generate

clean:
	rm -rf .venv build site *.egg-info .pytest_cache .ruff_cache .import_linter_cache
