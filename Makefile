# `make demo` and `make test` are all a fresh machine needs: each makes .venv and installs what it uses.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: demo test test-torch docs fuzz bench reproduce format clean

demo: $(VENV)/.demo
	$(BIN)/unconstrain demo --out out/demo --overwrite

# Two processes, a thread of BLAS each: with more they wait for each other.
test: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2

# PyTorch is 190 MB, and no other test needs it. Where the registry has it for GPUs alone, which is far more, say
# TORCH='torch==2.13.0 --index-url https://download.pytorch.org/whl/cpu'.
TORCH ?= torch==2.13.0
test-torch: $(VENV)/.torch
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/pytest tests/torch tests/policies/test_torch_policy.py

# The site, out/site/index.html: runs every example, and reads the result in a browser (Debian's package chromium).
# GALLERY=no leaves the examples unrun.
docs: $(VENV)/.docs
	rm -rf docs/api/generated out/site out/doctrees
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/sphinx-build --fail-on-warning --keep-going \
		--doctree-dir out/doctrees docs out/site
	$(BIN)/pytest tests/site

# Any number of inputs that nobody meant to give; those that fail are kept in out/fuzz.
N ?= 1000
fuzz: $(VENV)/.test
	$(BIN)/python -m tests.fuzz --number $(N) $(if $(SEED),--seed $(SEED))

# The two variables, where they are set, tell OpenBLAS to behave as on another machine than this.
bench: $(VENV)/.test
	env -u OPENBLAS_CORETYPE -u OPENBLAS_L2_SIZE $(BIN)/python -m benchmarks

# Every experiment of the paper takes hours; EXPERIMENT=toy runs one, OPTIONS="--trials 2" less of it. Finished trials are
# kept, and the same command goes on from them.
EXPERIMENT ?= all
reproduce: $(VENV)/.test
	$(BIN)/python -m reproduction $(EXPERIMENT) $(OPTIONS)

format: $(VENV)/.test
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) out docs/api/generated docs/gallery

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@touch $@ $(VENV)/.demo

$(VENV)/.torch: $(VENV)/.test
	$(BIN)/python -m pip install --quiet $(TORCH)
	@touch $@

$(VENV)/.docs: $(VENV)/.torch
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	@touch $@
