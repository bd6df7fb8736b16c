# Everything runs in .venv, which is made from pyproject.toml and made again when that changes; the
# demo in .venv-demo, which holds what users install and nothing of the gate.

PYTHON ?= python3
BIN := .venv/bin
MADE := .venv/.made-from-pyproject
DEMO_BIN := .venv-demo/bin
DEMO_MADE := .venv-demo/.made-from-pyproject
SAMPLE := missions/survey-vineyard.plan
VEHICLE := falkowski-2023-quadrotor

# Compiled modules are kept, whatever the shell says: each worker and each process that a test
# starts would compile them all again.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help setup demo test lint types layers unit whole long bench fuzz sitl format golden readme pictures rules drones models matrice sheets calibration stops clean

help: ## say what can be made
	@grep -E '^[a-z]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(MADE) ## make or renew the environment

$(MADE) $(DEMO_MADE): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "mavjoule needs Python 3.11 or later: make PYTHON=python3.11")'
	test -x $(@D)/bin/python || $(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(@D)/bin/python -m pip install --quiet --no-compile --editable . $(GROUP)
	-$(COMPILE)
	@touch $@

$(MADE): GROUP := --group dev
$(MADE): COMPILE = $(BIN)/python -m compileall -qq -j 0 .venv/lib planner  # on all cores; some files are no Python 3

demo: $(DEMO_MADE) ## check a sample mission
	@$(DEMO_BIN)/mavjoule check $(SAMPLE) --vehicle $(VEHICLE)
	@echo
	@echo "Try next:"
	@echo "  $(DEMO_BIN)/mavjoule check missions/crossing-too-far.plan --vehicle $(VEHICLE)    a no-go, and why"
	@echo "  $(DEMO_BIN)/mavjoule review missions/crossing-too-far.plan --vehicle $(VEHICLE)   why, on the screen; try what makes it go"
	@echo "  $(DEMO_BIN)/mavjoule segments $(SAMPLE) --vehicle $(VEHICLE)   the flight, segment by segment"
	@echo "  $(DEMO_BIN)/mavjoule vehicle new -o my-quad.toml --mass 1.6kg --battery 4S5200 --hover 18A   a model of your own drone"
	@echo "  $(DEMO_BIN)/mavjoule check $(SAMPLE) --vehicle my-quad.toml   it flies the sample; then YOUR.plan"

test: lint types layers unit ## the gate, in ten minutes: long tests by a few of their cases

lint: $(MADE)
	$(BIN)/ruff format --check
	$(BIN)/ruff check

types: $(MADE)  # on a machine so busy that its workers do not come in their three seconds, without them
	$(BIN)/mypy --num-workers 2 || $(BIN)/mypy

layers: $(MADE)
	$(BIN)/lint-imports

# Two cores: tests of lines, browsers and processes wait.
RUN := $(BIN)/pytest -q -n 3 --dist worksteal

unit: $(MADE)
	$(RUN) --thinned

whole: lint types layers ## the whole gate, with every case of every test
	$(RUN)

long: $(MADE) ## run every case, and measure anew which ones the gate leaves out
	$(RUN) --measured

bench: $(MADE) ## measure what has to be fast: make bench COMPARE=--compare FLIGHTS=folder
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=tests:. $(BIN)/python tests/speed_table.py $(COMPARE) $(if $(FLIGHTS),--flights $(FLIGHTS))
	$(BIN)/pytest -q -s -m bench tests/bench

SECONDS ?= 600

fuzz: $(MADE) ## feed readers, checks and lines with damage: make fuzz SECONDS=600
	PYTHONPATH=tests:. $(BIN)/python tests/fuzz/campaign.py --seconds $(SECONDS)
	PYTHONPATH=tests:. $(BIN)/python tests/fuzz/interruptions.py

sitl: $(MADE) ## do everything against builds of your own: make sitl ARDUCOPTER=binary PX4=binary
	@PYTHONPATH=tests:. $(BIN)/python tests/sitl/tour.py \
	  $(if $(ARDUCOPTER),--arducopter $(ARDUCOPTER)) $(if $(PX4),--px4 $(PX4))

format: $(MADE) ## put the code in shape
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

golden: $(MADE) ## write the sample reports in tests/report/golden anew
	$(BIN)/python tests/report/test_golden.py

readme: $(MADE) ## write the help and sample output in README.md again, and the keys in models/ and missions/README.md
	$(BIN)/python tests/project/test_readme.py
	PYTHONPATH=tests $(BIN)/python tests/vehicle/test_models_readme.py
	PYTHONPATH=tests $(BIN)/python tests/fleet/test_fleet_readme.py

pictures: $(MADE) ## draw the pictures of README.md in .ci/pictures again
	PYTHONPATH=tests:. $(BIN)/python tests/generate_pictures.py

rules: $(MADE) ## write planner/catalogue.json again: where each rule is declared, and its example
	PYTHONPATH=tests $(BIN)/python tests/generate_catalogue.py

drones: $(MADE) ## write the models of common drones again, from models/priors/drones.toml
	PYTHONPATH=tests $(BIN)/python tests/vehicle/test_drones.py

# The flights each shipped model is identified from, in the folder FLIGHTS: no others were used.
QUAD_LOGS := $(addsuffix /flight.BIN,ardupilot-S_A_vertical ardupilot-S_B_horizontal ardupilot-S_C_speedsweep)
SIH_LOGS := $(addsuffix /flight.ulg,px4-A_vertical px4-B_horizontal px4-C_speed_sweep)
MATRICE := $(FLIGHTS)/real/matrice-100
# 149 to 157 stand on the ground, as their sheet says; it names payloads and levels of the battery by log
MATRICE_LOGS := $(filter-out %/149.csv.gz %/151.csv.gz %/153.csv.gz %/155.csv.gz %/157.csv.gz, \
  $(shell seq -f $(MATRICE)/%03g.csv.gz 1 2 209))
MATRICE_TABLE := dist/matrice-100.csv
IDENTIFY := $(BIN)/mavjoule identify
# a model is dated by the commit that makes it: the same logs give the same file
SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct 2>/dev/null)

models: export SOURCE_DATE_EPOCH := $(SOURCE_DATE_EPOCH)
models: $(MADE) ## identify the shipped models anew: make models FLIGHTS=folder
	@test -d "$(FLIGHTS)" || { echo "make models FLIGHTS=folder: the folder of the recorded flights"; exit 2; }
	$(IDENTIFY) $(addprefix $(FLIGHTS)/,$(QUAD_LOGS)) -o models/arducopter-sitl-quad.toml \
	  --mass 3.5 --cells 6 --chemistry lipo-ardupilot-sitl \
	  --description "Simulated 3.5 kg survey quadrotor flown by ArduPilot; power by momentum theory, identified from three flights in calm air." \
	  --reading "The power of this vehicle is itself a momentum-theory model added to the simulator: that a model of the same form fits it says nothing about real vehicles."
	$(IDENTIFY) $(addprefix $(FLIGHTS)/,$(SIH_LOGS)) -o models/px4-sih-quad.toml \
	  --mass 1 --position-noise 0.31 \
	  --description "Simulated 1 kg quadrotor flown by PX4: time and distance only, its power was not identified." \
	  --reading "position_noise_m is measured: hovering and moving vertically in A, B and C the vehicle is 0.33, 0.31 and 0.31 m from its trajectory in the mean; the value is their median.  Simulated without noise, give --position-noise 0: flights are 2 to 6 % shorter."
	$(MAKE) $(MATRICE_TABLE)
	$(IDENTIFY) $(MATRICE_LOGS) -o models/dji-matrice-100.toml --table $(MATRICE_TABLE) \
	  --mass 3.715 --cells 6 --chemistry lipo \
	  --description "DJI Matrice 100 of Rodrigues et al. (2021): power by momentum theory over the payload, ramps, battery; identified from 100 flights of 4 h with 0 to 750 g."

$(MATRICE_TABLE): $(MATRICE)/PAYLOAD.csv
	mkdir -p $(@D)
	awk -F, 'NR == 1 { print "log,payload_kg,level_start_fraction,level_end_fraction" } \
	  NR > 1 { gsub("-", "", $$9); gsub("-", "", $$10); print $$1 ".csv.gz," $$2 "," $$9 "," $$10 }' $< > $@

matrice: $(MADE) $(MATRICE_TABLE) ## predict each flight of the Matrice by the others: make matrice FLIGHTS=folder
	PYTHONPATH=tests:. $(BIN)/python tests/matrice_figures.py $(MATRICE) $(MATRICE_TABLE) $(FLIGHTS)/real/matrice-100-missions

sheets: $(MADE) ## try models of data sheets on recorded flights: make sheets FLIGHTS=folder
	PYTHONPATH=tests:. $(BIN)/python tests/data_sheet_figures.py $(FLIGHTS)

calibration: $(MADE) ## how often recorded flights lie between p10 and p90: make calibration FLIGHTS=folder
	PYTHONPATH=tests:. $(BIN)/python tests/calibration_table.py $(FLIGHTS)

stops: $(MADE) ## how far recorded stops went beside their prediction: make stops FLIGHTS=folder
	PYTHONPATH=tests:. $(BIN)/python tests/stop_table.py $(FLIGHTS)

clean: ## remove the environments and every cache
	rm -rf .venv .venv-demo dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find planner tests -name __pycache__ -prune -exec rm -r {} +
