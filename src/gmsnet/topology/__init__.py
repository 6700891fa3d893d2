"""What follows from a mesh's connectivity, built once."""
