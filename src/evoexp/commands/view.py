"""`evoexp view`: motions as one offline page that plays them."""

import argparse

from evoexp.commands.motion_words import (
    add_motion_arguments,
    check_speeds,
    chosen_logs,
    output_path,
    write,
)
from evoexp.playback.kept_pages import KeptPage, kept_page


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_motion_arguments(parser, ".html")


def main(arguments: argparse.Namespace) -> int:
    """Write the page; one that was drawn before of the same logs by the same code is kept."""
    check_speeds(arguments)
    if logs := chosen_logs(arguments):
        speeds = repr((arguments.turn_speed, arguments.slide_speed))
        found = kept_page([log[:2] for log in logs], speeds, lambda: _drawn(arguments))
    else:
        found = _drawn(arguments)
    write(output_path(arguments, found.names, ".html"), found.content)
    return 0


def _drawn(arguments: argparse.Namespace) -> KeptPage:
    from evoexp.commands.motion_files import file_name, recordings  # Pinocchio, coal and numba
    from evoexp.playback.player_page import page

    motions = recordings(arguments)
    return KeptPage([file_name(each) for each in motions], page(motions))
