# Each target makes or refreshes .venv by itself; all that must be there is Python 3.11+ and make.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
# Docker's own subcommand on some machines, a program on others.
COMPOSE ?= $(shell docker compose version >/dev/null 2>&1 && echo docker compose || echo docker-compose)
# By the environment, not by a flag: the compose file names a network by it. What docker/.env says comes before our default.
export COMPOSE_PROJECT_NAME := $(or $(COMPOSE_PROJECT_NAME),$(shell sed -n "s/^COMPOSE_PROJECT_NAME=[\"']\{0,1\}\([^\"' ]*\).*/\1/p" docker/.env 2>/dev/null | tail -n 1),covista)
STACK := $(COMPOSE) --file docker/compose.yaml

# All tests wait a lot, so several processes share them; the tests of a file stay together.
TESTS := $(BIN)/pytest --numprocesses=auto --maxprocesses=4 --dist=loadfile
MAKEFLAGS += --no-print-directory
.DEFAULT_GOAL := help
.PHONY: help demo test check page-test api-test fuzz soak bench screenshots up down compose-test fault-test

help: ## Say what there is to make
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1: \2/p' Makefile

demo: .venv/.demo ## A station and six simulated rovers, until Ctrl-C
	@echo "demo: a station and a simulated swarm; Ctrl-C ends both"
	@exec $(BIN)/covista-station demo

test: .venv/.dev ## All tests that need neither a container nor a browser
	@echo "test: all tests that need neither a container nor a browser"
	@$(TESTS)

check: .venv/.dev ## Format, lint, types, contracts and tests: what must be green before a push
	@echo "check: format, lint, types, contracts, tests"
	@$(BIN)/ruff format --check --quiet
	@$(BIN)/ruff check --quiet
	@$(BIN)/mypy
	@said=$$($(BIN)/lint-imports) || { echo "$$said"; exit 1; }
	@$(TESTS)

page-test: .venv/.dev ## The dashboard's pages in a real browser, on a station that runs
	@echo "page-test: all pages in a browser, some minutes"
	@$(TESTS) -m browser tests/browser

api-test: .venv/.dev ## Thousands of questions to every route, all answers held to the description
	@echo "api-test: more than 5000 questions to a station, some minutes"
	@COVISTA_API_EXAMPLES=250 COVISTA_API_CASES=5000 $(BIN)/pytest -s tests/service/api/test_schemathesis.py

FUZZ_PAYLOADS ?= 1000000
# Memory beyond that is growth, which breaks the law too: neither target takes 300 MB.
FUZZ = $(BIN)/python -m tests.fuzz $(1) --payloads=$(FUZZ_PAYLOADS) -rss_limit_mb=400 -reduce_inputs=0 \
	-artifact_prefix=build/fuzz/ build/fuzz/$(1)
fuzz: .venv/.fuzz ## A million payloads each for codec and ingest, led by what they reach, held to laws
	@echo "fuzz: $(FUZZ_PAYLOADS) payloads for the codec, then as many for ingest, some minutes"
	@mkdir -p build/fuzz/codec build/fuzz/ingest
	@$(call FUZZ,codec)
	@$(call FUZZ,ingest)

SOAK_MINUTES ?= 30
SOAK_OUT ?= build/soak
soak: .venv/.dev ## Rovers that come, go and fail around one station for half an hour: does anything grow?
	@echo "soak: $(SOAK_MINUTES) minutes; $(SOAK_OUT) gets soak.png, soak.json and station.log"
	@COVISTA_SOAK_MINUTES=$(SOAK_MINUTES) COVISTA_SOAK_OUT=$(SOAK_OUT) $(BIN)/covista-station bench soak --long --strict

bench: .venv/.dev ## The benchmarks, beside their peers
	@echo "bench: every benchmark in its short form"
	@exec $(BIN)/covista-station bench

screenshots: .venv/.dev ## A picture of every page of the dashboard, into docs/pictures/dashboard
	@echo "screenshots: a demo, and a picture of each of its pages, four minutes"
	@$(BIN)/python -m tests.browser.screenshots

up: ## Station and rovers as containers, in the background
	@$(call need_engine)
	@echo "up: building the images"
	@BASE_IMAGE=$$(docker/base.sh) && export BASE_IMAGE && $(STACK) build --quiet
	@echo "up: starting station and rovers"
	@said=$$($(STACK) up --detach 2>&1) || { echo "$$said"; case "$$said" in (*"already allocated"*|*"already in use"*) \
		echo "A port is taken, say another: COVISTA_API_AT=127.0.0.1:8001 COVISTA_LINK_AT=127.0.0.1:7449 make up; make down removes what has started";; esac; exit 1; }
	@echo "The station answers at http://$$($(STACK) port station 8000)/api/v1/groups; rovers reach it at tcp/$$($(STACK) port station 7447)."
	@echo "make down ends all; the history stays in the volume $(COMPOSE_PROJECT_NAME)_history."

down: ## End what make up started
	@$(call need_engine)
	@echo "down: ending station and rovers"
	@$(STACK) down --remove-orphans

compose-test: .venv/.dev ## Station and rovers as containers, seen from outside and broken as the field breaks them
	@echo "compose-test: building, starting, asking and breaking station and rovers in containers, some ten minutes"
	@$(BIN)/pytest tests/compose -m compose

fault-test: .venv/.dev ## The faults five times, with a table of how soon each is noticed and recovered from
	@echo "fault-test: breaking rovers, networks, senders, station and stores in containers, half an hour"
	@COVISTA_FAULT_RUNS=5 $(BIN)/pytest tests/compose/faults -m compose

# The stamps: what is installed was installed for this pyproject.toml.
.venv/.demo: pyproject.toml | .venv/bin/python
	@echo "Installing the station into .venv (a minute or two)"
	@$(PIP) install --editable '.[station,dashboard]'
	@$(call warm)
	@touch $@

.venv/.dev: pyproject.toml | .venv/bin/python
	@echo "Installing the station and what develops it into .venv (a minute or two)"
	@$(PIP) install --editable '.[dev]'
	@$(call warm)
	@touch .venv/.demo $@

.venv/.fuzz: .venv/.dev
	@echo "Installing the fuzzer into .venv"
	@$(PIP) install --editable '.[fuzz]'
	@touch $@

.venv/bin/python:
	@command -v $(PYTHON) >/dev/null || { echo "Covista needs Python 3.11 or newer, and there is no $(PYTHON): make PYTHON=... names another"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Covista needs Python 3.11 or newer, and $(PYTHON) is $$($(PYTHON) --version): make PYTHON=... names another"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) cannot make an environment: on Debian, install python3-venv"; exit 1; }
	@echo "Making .venv with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv --clear .venv

# Here, so that the first start need not wait for a compiler.
define warm
echo "Compiling what is compiled (a minute or two)" && $(BIN)/python -c 'from covista_service.workers import load; load()'
endef

define need_engine
docker info >/dev/null 2>&1 || { echo "No Docker engine answers here: start one, or run make demo, which needs none"; exit 1; }
endef
