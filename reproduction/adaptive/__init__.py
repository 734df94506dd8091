"""Which samples were free is inferred, not told: measured on everything this project has data of."""
