"""The documentation as it was built: `make docs` builds it and runs these."""
