"""From words of the command line to experiments and conditions."""
