# Every target works on a bare machine: Python 3.11 or newer with venv, make and a package index are all it takes.
# PYTHON=/path/to/python picks the interpreter that `.venv` is made from; WORKERS=n picks the number of test processes.
# KERNELS picks the kernels of `make test-kernels`, PYTHONS the interpreters of `make test-pythons`.
# ROUNDS=n says how often a benchmark runs; each has a number of its own otherwise.
# pip itself is brought up to date first where that is possible: the one that comes with Python takes longer to choose versions.
# CONSTRAINTS=constraints.txt installs the very versions that the project was last tested with.

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install constraints test test-all test-kernels test-pythons quick-tests numerical-tests lint style rules format demo docs bench bench-methods reproduce clean FORCE

VENV := .venv
BIN := $(VENV)/bin
PROGRAM := $(VENV)/.program
STAMP := $(VENV)/.installed
DOCS_STAMP := $(VENV)/.docs-installed
WORKERS ?= auto
PYTHONS ?= python3.12 python3.13 python3.14 $(wildcard $(HOME)/.pyenv/versions/3.1[2-9]*/bin/python)
NUMERICAL := $(addprefix tests/,certify checks geometry measures planning scene search)
ROUND_OPTION := $(if $(ROUNDS),--rounds $(ROUNDS))
USABLE := import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))
comma := ,

export PIP_DISABLE_PIP_VERSION_CHECK := 1

help:
	@echo "make demo      install cellplan alone, solve the shipped four-robot cell, and say where its report and 3-D page are"
	@echo "make test      formatter, linter, types, import rules, sizes and all quick tests"
	@echo "make test-all  the same with the slow tests"
	@echo "make test-kernels  the numerical tests under each kernel of OpenBLAS, two to ten minutes a kernel; KERNELS='Haswell baseline' picks"
	@echo "make test-pythons  the numerical tests with each newer Python that is installed, each in an environment of its own"
	@echo "make lint      everything but the tests"
	@echo "make install   only make .venv; with CONSTRAINTS=constraints.txt in the versions of that file"
	@echo "make constraints  write the installed versions to constraints.txt"
	@echo "make docs      write the documentation as a site to site/; warnings are errors"
	@echo "make bench     measure speed, beside other libraries and brute force, and write docs/benchmarks.md"
	@echo "make reproduce solve the cells of the three papers and write docs/reproduction.md, ten to twenty minutes"
	@echo "make bench-methods  run every method on the same cells (a quarter of an hour); writes docs/guides/which-method.md"
	@echo "make format    put the code into shape"
	@echo "make clean     remove .venv, caches and results"

# The stamp holds the folder it was made in: a checkout that was moved or copied is installed again.
ifneq ($(shell cat $(PROGRAM) 2>/dev/null),$(CURDIR))
$(PROGRAM): FORCE
endif

# pip names each package as it comes; of its output only these names are shown. Sizes were measured on Linux x86-64.
PACKAGES := awk '/^Collecting |^Processing .*whl/ { name = $$2; sub(".*/", "", name); sub("(-[0-9]|[<>=!~;[]).*", "", name); \
            if (!(name in seen)) { seen[name]; printf "  %2d %s\n", ++n, name; fflush() } } \
            /^Installing collected/ { print "  unpacking"; fflush() }'

$(PROGRAM): pyproject.toml
	@set -e; begin=$$(date +%s); \
	python=""; \
	for candidate in $(if $(PYTHON),"$(PYTHON)",python3 python3.13 python3.12 python3.11 python3.14 python); do \
	    if "$$candidate" -c "$(USABLE)" >/dev/null 2>&1; then python="$$candidate"; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
	    echo "make: no usable Python: expected 3.11 or newer with the modules venv and ensurepip$(if $(PYTHON),$(comma) got PYTHON=$(PYTHON));" \
	         "install it (Debian and Ubuntu: apt install python3 python3-venv) or say make PYTHON=/path/to/python" >&2; \
	    exit 1; \
	fi; \
	if ! $(BIN)/python -m pip --version >/dev/null 2>&1 || ! $(BIN)/python -c "$(USABLE)" >/dev/null 2>&1; then \
	    echo "making $(VENV) from $$("$$python" -c 'import platform, sys; print(sys.executable, platform.python_version())')"; \
	    "$$python" -m venv --clear $(VENV); \
	fi; \
	echo "installing cellplan into $(VENV): about 110 MB to download, 600 MB on disk, a minute or two"; \
	$(BIN)/python -m pip install --quiet --upgrade pip || true; \
	rm -f $@.done; \
	{ PYTHONUNBUFFERED=1 $(BIN)/python -m pip install $(if $(CONSTRAINTS),--constraint '$(CONSTRAINTS)') --editable . && touch $@.done; } \
	    | $(PACKAGES); \
	rm $@.done 2>/dev/null || { echo "make: pip could not install cellplan; its message stands above" >&2; exit 1; }; \
	$(BIN)/python -m compileall -q cellplan; \
	echo "installed: $$(du -sm $(VENV) | cut -f 1) MB in $$(($$(date +%s) - begin)) s"; \
	printf '%s' '$(CURDIR)' >$@

$(DOCS_STAMP): $(PROGRAM) pyproject.toml
	@echo "installing what the documentation is made with"
	@$(BIN)/python -m pip install --quiet $(if $(CONSTRAINTS),--constraint '$(CONSTRAINTS)') --editable '.[docs]'
	@touch $@

$(STAMP): $(PROGRAM) pyproject.toml
	@echo "installing the tools of the tests into $(VENV)"
	@$(BIN)/python -m pip install --quiet $(if $(CONSTRAINTS),--constraint '$(CONSTRAINTS)') --editable '.[dev]'
	@touch $@

install: $(STAMP)

constraints: $(STAMP) $(DOCS_STAMP)
	@echo "# The versions that the project was last tested with; written by \`make constraints\`." >constraints.txt
	$(BIN)/python -m pip freeze --exclude-editable >>constraints.txt

lint: style rules

style: $(STAMP)
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m ruff check .

rules: $(STAMP)
	$(BIN)/python -m mypy
	$(BIN)/lint-imports

# Types and import rules keep one core busy for a minute, which the tests can use the others of.
test: style
	@$(MAKE) --no-print-directory -j2 rules quick-tests

# Without their rewriting, assertions are loaded in half the time; what fails is shown with it. All processes that tests
# start load the package as it is compiled here, also where PYTHONDONTWRITEBYTECODE keeps them from doing so themselves.
quick-tests: $(STAMP)
	@$(BIN)/python -m compileall -q cellplan tests benchmarks
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadscope -m "not slow" --assert=plain || { \
	    echo "once more, with the values in the assertions that failed"; \
	    $(BIN)/python -m pytest -q -m "not slow" --last-failed --last-failed-no-failures none; exit 1; }

test-all: lint $(DOCS_STAMP)
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadscope

# Figures differ in their last digits from kernel to kernel; a test holds under each of them.
test-kernels: $(STAMP)
	$(BIN)/python tests/kernels.py $(KERNELS) -- -n $(WORKERS) --dist loadscope

numerical-tests: $(STAMP)
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadscope -m "not slow" --assert=plain -p no:cacheprovider $(NUMERICAL)

# Each version once, in an environment outside of the tree that goes again.
test-pythons:
	@folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; tested=""; failed=""; \
	for python in $(PYTHONS); do \
	    version=$$("$$python" -c '$(USABLE)' 2>/dev/null && "$$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])') \
	        || { echo "not run: $$python is not installed"; continue; }; \
	    case " $$tested " in *" $$version "*) continue;; esac; tested="$$tested $$version"; \
	    echo "testing with Python $$version, $$python"; \
	    $(MAKE) --no-print-directory numerical-tests VENV="$$folder/$$version" PYTHON="$$python" || failed="$$failed $$version"; \
	done; \
	echo "tested with Python:$${tested:- none}; failed:$${failed:- none}"; [ -n "$$tested" ] && [ -z "$$failed" ]

format: $(STAMP)
	$(BIN)/python -m ruff check --fix .
	$(BIN)/python -m ruff format .

demo: $(PROGRAM)
	@echo "solving cells/four_robots.yaml: four robots, one of which turns the part that the others work on"
	@$(BIN)/python -m cellplan solve cells/four_robots.yaml --view
	@echo "open these in a browser:"
	@echo "  $(CURDIR)/outputs/four-robots/report.html"
	@echo "  $(CURDIR)/outputs/four-robots/view.html"
	@echo "drag its bases in a browser, and see at once what becomes of the whole job:"
	@echo "  $(BIN)/cellplan edit cells/four_robots.yaml"
	@echo "the program is $(BIN)/cellplan; after '. $(BIN)/activate' it is called cellplan"

# The variable silences an advertisement of the theme, which colours the output.
docs: $(DOCS_STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build
	@echo "open site/index.html in a browser"

bench: $(STAMP)
	$(BIN)/python benchmarks/peer_setup.py
	$(BIN)/python benchmarks/page.py $(ROUND_OPTION)
	$(BIN)/python benchmarks/stages.py --write $(ROUND_OPTION)

reproduce: $(STAMP)
	$(BIN)/python docs/make_reproduction.py

bench-methods: $(STAMP)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python benchmarks/methods.py $(ROUND_OPTION)

clean:
	rm -rf $(VENV) .venv-bench .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache dist site outputs/*/
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
