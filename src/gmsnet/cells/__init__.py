"""Facts about the kinds of cells that hold in every format and every part of the package."""
