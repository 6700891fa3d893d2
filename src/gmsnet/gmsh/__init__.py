"""Gmsh: smooth the mesh of the model that is open in it. Gmsh itself is the user's, and is not imported here."""

from gmsnet.gmsh.smoothing import smooth

__all__ = ["smooth"]
