"""The commands: one small file each, with `add_arguments` and `main`."""
