"""How good a mesh is: measures per cell, reports, targets, bounds."""
