"""What is kept: run directories, self-contained logs, derived tables.

And the digests that compare them.
"""
