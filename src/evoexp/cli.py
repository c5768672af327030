"""The command line: parses words, calls one command, turns errors into one line and an exit code.

Exit codes: 0 done; 1 a replicate or a comparison failed; 2 the command could not be done;
130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by a terminal that closed.
"""

import contextlib
import errno
import os
import sys
from collections.abc import Sequence

from evoexp.commands import command_process
from evoexp.commands.command_parser import COMMANDS, command_function, command_parser, whole_parser
from evoexp.commands.command_process import OUTPUT, Interrupted, Interruption, complain
from evoexp.errors import EvoexpError

KEPT = "finished replicates are kept, the same command runs the others"
_DISK_ERRORS = {errno.ENOSPC, errno.EDQUOT, errno.EIO}  # full, or defective
_OUTPUT_ERRORS = _DISK_ERRORS | {errno.EPIPE}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code.

    Args:
        arguments: Words of the command; None: those that this process was started with. Its
            signals, its standard streams and its temporary files are then ours.
    """
    interruption, is_process = Interruption(), arguments is None
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        if is_process:
            os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # no threads that have nothing to do
            os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")  # its own one keeps 40 MB
            os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # looked for everywhere
            command_process.open_streams()
            interruption.hear()
        code = _run(words, is_process)
        sys.stdout.flush()  # here, where an error is explained
        return code
    except BaseException as error:
        interruption.end()
        return _explain(error, words, interruption)
    finally:
        interruption.end()
        if is_process:
            command_process.settle_streams()


def _run(words: Sequence[str], is_process: bool) -> int:
    if not words or words[0] not in COMMANDS:
        parser, _ = whole_parser()
        parser.parse_args(words)
        parser.print_help()
        return 0
    chosen = words[0]
    command_process.refuse_too_little_memory()
    if is_process:
        command_process.use_temporary_folder()
    given = command_parser(chosen).parse_intermixed_args(words[1:])
    with contextlib.ExitStack() as stack:
        if folders := getattr(given, "config_dir", ()):
            from evoexp.configuration.search_path import searched_first

            stack.enter_context(searched_first(folders))
        stack.enter_context(command_process.notices_in_lines())
        return int(command_function(chosen)(given))


def _explain(error: BaseException, words: Sequence[str], interruption: Interruption) -> int:
    if isinstance(error, SystemExit):
        raise error
    kept = f"; {KEPT}" if words[:1] == ["run"] else ""
    if isinstance(error, Interrupted | KeyboardInterrupt) or interruption.number is not None:
        complain(f"interrupted{kept}")  # and whatever fails after it, fails of it
        return interruption.exit_code
    if isinstance(error, EvoexpError):
        complain(str(error))
        return 2
    if text := command_process.memory_shortage(error):
        complain(text)
        return 2
    if not isinstance(error, OSError) or error.errno is None:
        raise error
    is_output = error.errno in _OUTPUT_ERRORS and error.filename is None  # files are named
    if is_output and isinstance(error, BrokenPipeError):
        return 0
    path = OUTPUT if is_output else error.filename2 or error.filename
    if error.errno not in _DISK_ERRORS:
        kept = ""
    complain(f"{path or 'the system refused a request'}: {error.strerror}{kept}")
    return 2
