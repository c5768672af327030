"""The five papers: pages, figures, claims and printed numbers; found as a guest's are."""
