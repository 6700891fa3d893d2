"""A whole mesh at once: the graph of its moving nodes, multigrid on it, and steps of all nodes together."""
