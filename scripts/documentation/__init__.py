"""The documentation site: `make docs` executes examples and notebooks, then builds the pages."""
