"""The store: run directories, self-contained logs, derived tables, and digests to compare them."""
