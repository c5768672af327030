"""Bit-reproducible numbers: compilation, elementary functions, random stream, kernel cache."""
