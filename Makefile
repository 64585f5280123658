# SPDX-License-Identifier: GPL-3.0-or-later
# Thin fronts over CMake; everything here can be typed by hand (docs/development.md).
# The release preset is what the demo, the tests and the image use.
PRESET ?= release
JOBS   ?= $(shell nproc)
BUILD  := build/$(PRESET)

.DEFAULT_GOAL := help
.PHONY: help setup configure build demo test test-kernels studies bench verify stability sensing interchange surgeries anatomy evidence ablations replays calculix prior advice page faults scaling cohort fuzz documents format format-check tidy packages image clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | column -t -s '|' 2>/dev/null \
	  || sed -n 's/^\([a-z-]*\):.*## /  make \1  /p' $(MAKEFILE_LIST)

setup: ## install the Debian packages that are missing (root or sudo)
	@docker/install-packages.sh docker/packages-build.txt

configure: setup
	@cmake --preset $(PRESET) --log-level=WARNING

build: configure ## build the programs and the tests into build/release
	cmake --build --preset $(PRESET) -j $(JOBS)

demo: configure ## build the binaries and run the whole job on the default case, into demo/
	cmake --build --preset $(PRESET) -j $(JOBS) --target brainshiftd brainshift bench_error_time
	cmake/scripts/demo.sh $(BUILD)/bin

test: build ## build and run the tests of the product
	cmake/scripts/run-tests.sh $(PRESET)

studies: configure ## build the programs of the studies and run their smoke tests
	cmake --build --preset $(PRESET) -j $(JOBS) --target studies
	cmake/scripts/run-tests.sh studies

test-kernels: build ## what computes with BLAS, again with OpenBLAS kernels of other processors; KERNELS="Haswell SkylakeX Nehalem"
	cmake/scripts/test-kernels.sh $(PRESET) $(KERNELS)

bench: configure ## error against run time, latency, memory, into out/bench; QUICK=1 for a short run
	cmake --build --preset $(PRESET) -j $(JOBS) --target bench_programs
	cmake/scripts/bench.sh $(BUILD)/bin

verify: configure ## the solver against closed forms and series, into out/verify
	cmake --build --preset $(PRESET) -j $(JOBS) --target verification_programs
	cmake/scripts/verify.sh $(BUILD)

stability: configure ## sweeps to the edges of what may be asked, maps and summary.json, into out/stability
	cmake --build --preset $(PRESET) -j $(JOBS) --target stability_programs
	cmake/scripts/stability.sh $(BUILD)/bin

sensing: setup ## registration, ultrasound, stereopsis, joint data: accuracy and time, into out/sensing
	@docker/install-packages.sh docker/packages-sensing.txt
	@cmake --preset $(PRESET) --log-level=WARNING
	cmake --build --preset $(PRESET) -j $(JOBS) --target sensing_programs
	cmake/scripts/sensing.sh $(BUILD)

interchange: setup ## exported fields in ITK, elastix, plastimatch, workbench, nibabel and VTK, into out/interchange
	@docker/install-packages.sh docker/packages-interchange.txt
	@cmake --preset $(PRESET) --log-level=WARNING
	cmake --build --preset $(PRESET) -j $(JOBS) --target interchange_programs
	cmake/scripts/interchange.sh $(BUILD)

surgeries: configure ## many different simulated surgeries on two heads, scored, into out/surgeries; hours; KINDS=a,b; RESUME=1 goes on
	cmake --build --preset $(PRESET) -j $(JOBS) --target surgery_programs
	cmake/scripts/surgeries.sh $(BUILD)

anatomy: configure ## surgeries estimated with and without falx, tentorium and ventricles of a label map, into out/anatomy; QUICK=1, RESUME=1
	cmake --build --preset $(PRESET) -j $(JOBS) --target anatomy_programs
	cmake/scripts/anatomy.sh $(BUILD)

evidence: configure ## twins of the paper's five patients against truths with another mesh, gap, stiffness ..., into out/evidence; QUICK=1
	cmake --build --preset $(PRESET) -j $(JOBS) --target evidence_programs
	cmake/scripts/evidence.sh $(BUILD)

ablations: configure ## what each part of the default estimate buys: it is switched off, one at a time, into out/ablations; QUICK=1
	cmake --build --preset $(PRESET) -j $(JOBS) --target ablation_programs
	cmake/scripts/ablations.sh $(BUILD)

replays: configure ## five recorded surgeries through the daemon at 1x and at full speed, timed, into out/replays; QUICK=1
	cmake --build --preset $(PRESET) -j $(JOBS) --target replay_programs
	cmake/scripts/replays.sh $(BUILD)

calculix: setup ## a slit with a sheet, and the patients of `make evidence`, whose fields are one of its truths, in CalculiX, into out/calculix
	@docker/install-packages.sh docker/packages-calculix.txt
	@cmake --preset $(PRESET) --log-level=WARNING
	cmake --build --preset $(PRESET) -j $(JOBS) --target evidence_calculix slit_deck
	cmake/scripts/calculix.sh $(BUILD)

prior: configure ## brains drawn from the prior against published brain shift, into out/prior; QUICK=1 for a short run
	cmake --build --preset $(PRESET) -j $(JOBS) --target prior_programs
	cmake/scripts/prior.sh $(BUILD)

advice: configure ## what `brainshift advise` predicts against measurements that are made, into out/advice; QUICK=1, RESUME=1
	cmake --build --preset $(PRESET) -j $(JOBS) --target advice_programs
	cmake/scripts/advice.sh $(BUILD)

page: configure ## the page of `brainshift view` in Chromium beside a daemon, timed, into out/page; CASE=FILE, MODEL=FILE
	cmake --build --preset $(PRESET) -j $(JOBS) --target brainshiftd brainshift python_client
	cmake/scripts/page.sh $(BUILD)

faults: setup ## the daemon through kills, bad peers, stalls, loads; into out/faults; TOPICS="kills rate", BRIEF=1
	@docker/install-packages.sh docker/packages-faults.txt
	@cmake --preset $(PRESET) --log-level=WARNING
	cmake --build --preset $(PRESET) -j $(JOBS) --target fault_programs
	cmake/scripts/faults.sh $(BUILD) out/faults $(TOPICS)

scaling: setup ## preparing a model by one process and by several (MPI), measured and extrapolated, into out/scaling; QUICK=1, EDGES, RANKS
	@docker/install-packages.sh docker/packages-mpi.txt
	@cmake --preset $(PRESET) --log-level=WARNING -DBRAINSHIFT_MPI=ON
	cmake --build --preset $(PRESET) -j $(JOBS) --target scaling_programs
	cmake/scripts/scaling.sh $(BUILD)

cohort: setup ## brainshift-bids on real heads (BRAINSHIFT_EXTERNAL_DATA), into out/cohort; SUBJECTS=N, ENGINES=1: Snakemake and Slurm too
	@docker/install-packages.sh docker/packages-cohort.txt
	@cmake --preset $(PRESET) --log-level=WARNING
	cmake --build --preset $(PRESET) -j $(JOBS) --target brainshiftd brainshift python_client
	cmake/scripts/cohort.sh $(BUILD)

documents: configure ## what docs/slicer.md, python.md and cpp.md say, typed as written; needs THROWAWAY=1, since it installs
	cmake --build --preset $(PRESET) -j $(JOBS) --target brainshiftd brainshift python_client
	cmake/scripts/documents.sh $(BUILD)

fuzz: setup ## random inputs for every reader and decoder, SECONDS=60 each, into out/fuzz
	@docker/install-packages.sh docker/packages-fuzz.txt
	@cmake --preset fuzz --log-level=WARNING
	cmake --build --preset fuzz -j $(JOBS)
	cmake/scripts/fuzz.sh build/fuzz/bin $(or $(SECONDS),60)

format: ## rewrite the C++ sources in the house format
	@cmake/scripts/clang-format.sh write

format-check: ## fail where a C++ source is not in the house format
	@cmake/scripts/clang-format.sh check

tidy: setup ## run clang-tidy over common/, server/ and client/
	@cmake/scripts/clang-tidy.sh build/tidy

packages: configure ## Debian packages of the programs and of the client library, into out/packages
	@cmake --build --preset release --target brainshiftd brainshift brainshift_client_lib
	@mkdir -p out/packages && cd out/packages && cpack --config ../../build/release/CPackConfig.cmake >cpack.log 2>&1 || { tail -n 20 cpack.log >&2; exit 1; }
	@rm -rf out/packages/_CPack_Packages && ls out/packages/*.deb

image: ## build the container image and start it once, without a container engine (root)
	docker/build-image-without-engine.sh

clean: ## remove what the targets above have made
	rm -rf build demo
