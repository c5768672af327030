"""What is kept: run directories, self-contained logs, derived tables, and the digests that compare them."""
