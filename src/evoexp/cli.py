"""The command line: parses words, calls one command, turns errors into one line and an exit code.

Exit codes: 0 done; 1 a replicate or a comparison failed; 2 the command could not be done;
130 interrupted.
"""

import contextlib
import importlib
import os
import sys
from collections.abc import Sequence

from evoexp.commands.command_parser import COMMANDS, command_module, command_parser, whole_parser
from evoexp.commands.damage_lines import damage_in_lines
from evoexp.errors import EvoexpError, printable

WITH_WORKERS = ("run", "reproduce")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] not in COMMANDS:
        parser = whole_parser()
        parser.parse_args(words)
        parser.print_help()
        return 0
    chosen = words[0]
    if arguments is None and chosen in WITH_WORKERS and not {"-h", "--help"} & set(words):
        importlib.import_module("evoexp.batch.workers").start_server()  # this process is all ours
    try:
        given = command_parser(chosen).parse_intermixed_args(words[1:])
        with contextlib.ExitStack() as stack:
            if folders := getattr(given, "config_dir", ()):
                from evoexp.configuration.search_path import searched_first

                stack.enter_context(searched_first(folders))
            stack.enter_context(damage_in_lines())
            return int(command_module(chosen).main(given))
    except EvoexpError as error:
        print(f"evoexp: {printable(' '.join(str(error).split()))}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(
            "evoexp: interrupted; finished replicates are kept, the same command runs the others",
            file=sys.stderr,
        )
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        if error.filename is None:
            raise
        print(f"evoexp: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
