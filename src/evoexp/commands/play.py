"""`evoexp play`: a motion as an MCAP that plays in Foxglove."""

import argparse

from evoexp.commands.chosen_motions import output_path, single, write
from evoexp.playback.playable_log import LAYOUT, layout, playable_log


def main(arguments: argparse.Namespace) -> int:
    """Write the log, and the layout file beside it."""
    motion = single(arguments)
    path = output_path(arguments, [motion], ".mcap")
    write(path, playable_log(motion))
    write(path.with_name(LAYOUT), layout())
    return 0
