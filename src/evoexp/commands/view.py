"""`evoexp view`: motions as one offline page that plays them."""

import argparse

from evoexp.commands.motion_words import add_motion_arguments, output_path, write


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_motion_arguments(parser, ".html")


def main(arguments: argparse.Namespace) -> int:
    """Write the page."""
    from evoexp.commands.motion_files import file_name, recordings  # Pinocchio, coal and numba
    from evoexp.playback.player_page import page

    motions = recordings(arguments)
    names = [file_name(each) for each in motions]
    write(output_path(arguments, names, ".html"), page(motions))
    return 0
