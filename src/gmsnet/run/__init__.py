"""One call of ``smooth``: options, stages, sweeps, the best mesh, the result."""
