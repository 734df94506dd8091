"""How far a cluster carries a fit: Dask's own scheduler, driven by simulated workers on simulated time."""
