"""The mesh as a value: points, cell blocks, markers, checks of them, and the adapters from and to other types."""
