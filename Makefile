# One virtual environment beside the sources; CI pins torch through constraints.txt, users need not.
PYTHON ?= python3
CONSTRAINTS ?= constraints.txt
BIN := .venv/bin
DATA ?= ../shared/data/real

.PHONY: install demo test light dist lint types docs bench clean

install: .venv/installed

.venv/installed: pyproject.toml constraints.txt
	@echo "Everything, for development, goes into .venv: 3 to 7 GB, most of it torch and open3d. It takes minutes once."
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --constraint $(CONSTRAINTS) --editable ".[all,test,dev]"
	touch $@

demo: install
	$(BIN)/python -m hybridreg demo --out out/demo

test: install
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 2 --dist loadfile

# What a plain `pip install hybridreg` gives: the wheel in an environment of its own, without torch and open3d.
light:
	PYTHON=$(PYTHON) tools/light.sh build/light

# What could be uploaded as it is.
dist: install
	rm -rf dist && $(BIN)/python -m build && $(BIN)/twine check --strict dist/*

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# Against the installed wheel, as a user's type checker sees it: a second environment that holds the wheel alone and
# borrows the first one's packages.
types: install
	rm -rf build/lib build/types && $(PYTHON) -m venv build/types
	build/types/bin/python -m pip install --quiet --no-deps .
	cd build/types/lib/python3*/site-packages && ls -d "$(CURDIR)"/.venv/lib/python3*/site-packages > borrowed.pth
	cd build && ../$(BIN)/mypy --config-file ../pyproject.toml --python-executable types/bin/python -p hybridreg

# The site, in an environment of its own: it reads the sources and imports nothing of them.
docs: .venv-docs/installed
	NO_MKDOCS_2_WARNING=1 .venv-docs/bin/mkdocs build --strict

.venv-docs/installed: docs/requirements.txt
	$(PYTHON) -m venv .venv-docs
	.venv-docs/bin/python -m pip install --quiet --requirement docs/requirements.txt
	touch $@

bench: install
	$(BIN)/python -m benchmarks --data $(DATA)

clean:
	rm -rf .venv .venv-docs build out
