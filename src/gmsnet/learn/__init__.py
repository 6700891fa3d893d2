"""Training: the network in PyTorch, its loss and data, and the export of weights. Imports torch only on use."""
