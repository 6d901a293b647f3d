# Everything goes through cargo's release profile, so that dependencies are built once.

CARGO ?= cargo
PYTHON ?= python3
SCENE ?= experiments/gramling/gramling.lam
OUT ?= results/$(basename $(notdir $(SCENE)))
VENV := target/python

.DEFAULT_GOAL := help
.PHONY: help run test check bench bless soak clean cargo

help: ## List the targets
	@echo "Targets:"
	@sed -n 's/^\([a-z]*\):[^#]*## \(.*\)/  make \1#\2/p' $(MAKEFILE_LIST) | \
		while IFS='#' read -r name what; do printf '%-14s %s\n' "$$name" "$$what"; done

run: cargo ## Run the Gramling column (SCENE=… OUT=… for another scene) and draw its figure
	@$(CARGO) run --release --quiet -- run $(SCENE) --out $(OUT) --plot
	@echo "figure:      $(OUT)/figure.svg"
	@echo "error table: above, and in $(OUT)/points.parquet"

test: cargo ## Run all tests; with python3 also those that open the tables in other tools
	@python=$$(./.ci/python $(PYTHON) $(VENV)) || exit 1; \
	if [ -n "$$python" ]; then LAMELLA_PYTHON="$$python" $(CARGO) test --release; \
	else env -u LAMELLA_PYTHON -u CI $(CARGO) test --release; fi

check: cargo ## Look at format, lints and documentation
	$(CARGO) fmt --check
	$(CARGO) clippy --release --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --no-deps --document-private-items

bench: cargo ## Measure the hot loops (takes minutes; close other programs first)
	$(CARGO) bench --bench step
	$(CARGO) bench --bench speciation
	$(CARGO) bench --bench flow
	$(CARGO) bench --bench exchange
	$(CARGO) bench --bench density

bless: cargo ## Accept the present output of all snapshot tests; look at the difference before you commit
	INSTA_UPDATE=always LAMELLA_BLESS=1 $(CARGO) test --release

soak: cargo ## Run the experiments in full, kill sweeps 200 times, check a million damaged scenes (takes half an hour)
	LAMELLA_SOAK=1 $(CARGO) test --release --test experiments --test error_bars -- --nocapture --test-threads 1
	LAMELLA_SOAK=1 $(CARGO) test --release --test sweeps killed
	$(CARGO) run --release --example fuzz_check -- 1000000

clean: ## Remove what was built; results stay
	rm -rf target

cargo:
	@command -v $(CARGO) >/dev/null 2>&1 || { \
		echo "cargo is missing: install Rust from https://rustup.rs, then call make again." >&2; exit 1; }
