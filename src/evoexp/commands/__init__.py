"""The commands: a file each with its `main`, and the words, motions and runs that they share."""
