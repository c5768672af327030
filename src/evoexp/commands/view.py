"""`evoexp view`: motions as one offline page that plays them."""

import argparse

from evoexp.commands.chosen_motions import output_path, recordings, write
from evoexp.playback.player_page import page


def main(arguments: argparse.Namespace) -> int:
    """Write the page."""
    motions = recordings(arguments)
    write(output_path(arguments, motions, ".html"), page(motions))
    return 0
