# `make demo` opens the cockpit on a simulated robot; `make test` runs every check.
# Both do all their own set-up in a clean checkout (scripts/setup.sh says what, and what is missing).
SHELL := /bin/bash
.DEFAULT_GOAL := help
BIN := .venv/bin
export PYTHON

.PHONY: help demo rviz-demo view-demo check test test-all setup dev lint types docs wheel coverage bench clean

help: ## show this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 20

demo: ## open the demo cockpit on a simulated robot (20 s on a virtual screen where there is no display)
	@scripts/setup.sh demo
	@$(BIN)/rosglass demo $(DEMO_ARGS)

rviz-demo: ## open RViz with a dashboard on a simulated robot (20 s on a virtual screen where there is no display)
	@scripts/setup.sh rviz-demo
	@ROSGLASS_QT=pyside2 .venv-system/bin/python -m rosglass.demo.rviz

view-demo: ## open a dashboard over the 3D view of a simulated ROS 2 robot, without RViz (20 s on a virtual screen where there is no display)
	@scripts/setup.sh demo
	@$(BIN)/python -m rosglass.demo.view

check: dev ## run lint, types and the quick unit tests, for between two edits
	@scripts/check.sh

test: ## run lint, types, docs and the tests in both environments (10 minutes on two cores)
	@scripts/setup.sh test
	@scripts/test.sh

test-all: ## run every test in both versions of Qt and in RViz, all mutants, and every type against every peer
	@scripts/setup.sh test
	@scripts/test.sh --all

setup: ## prepare both environments without running anything
	@scripts/setup.sh test

dev:
	@scripts/setup.sh dev

lint: dev ## check style and format
	@$(BIN)/ruff check . && $(BIN)/ruff format --check .

types: dev ## check types strictly
	@$(BIN)/mypy

docs: dev ## build the documentation into site/
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet && echo "open site/index.html"

wheel: dev ## build the wheel into dist/
	@$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist . && ls dist/*.whl

coverage: ## run the tests of the standalone environment, and write what they reach into htmlcov/
	@scripts/setup.sh test
	@scripts/private_network.sh $(BIN)/python -m pytest -q -n 3 --dist loadfile --ignore=tests/rviz \
	  -m "not exhaustive" --cov --cov-report=term --cov-report=html

bench: ## run every benchmark (an hour, half of it watching memory)
	@scripts/bench.sh

clean: ## remove everything that set-up and builds made
	@rm -rf .venv .venv-system .venv-rclpy .stamps site dist build demo.png rviz-demo.png view-demo.png htmlcov .coverage* coverage.xml
