"""`evoexp play`: a motion as an MCAP that plays in Foxglove."""

import argparse

from evoexp.commands.motion_files import file_name, single
from evoexp.commands.motion_words import add_motion_arguments, output_path, write
from evoexp.playback.playable_log import LAYOUT, layout, playable_log


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_motion_arguments(parser, ".mcap")


def main(arguments: argparse.Namespace) -> int:
    """Write the log, and the layout file beside it."""
    found = single(arguments)
    path = output_path(arguments, [file_name(found)], ".mcap")
    write(path, playable_log(found))
    write(path.with_name(LAYOUT), layout())
    return 0
