"""Speed, as ratios taken within one run: `make bench`, or `python -m benchmarks [NAME ...]`."""
