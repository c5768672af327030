"""my_paper: a paper for evoexp."""
