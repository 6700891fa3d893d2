"""What is there on purpose, anisotropic layers and cell sizes near walls, and how it is protected."""
