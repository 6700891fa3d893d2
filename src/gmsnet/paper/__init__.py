"""The paper's cases, tables and figures, and its methods in plain Python."""
