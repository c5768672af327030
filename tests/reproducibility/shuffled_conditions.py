"""A process of its own: runs replicate 0 of conditions in a seeded order, prints what they gave.

Usage: shuffled_conditions.py DIRECTORY [SEED …]; DIRECTORY holds `conditions`, one per line, and in
`files` the files that they refer to. First every condition runs alone, in a process forked from
this one, then all of them run here, once per seed and each time in another order. Prints one JSON
object per order, that of the lonely ones first: condition → hash of its log without its times.
"""

import hashlib
import json
import multiprocessing
import random
import sys
from pathlib import Path

from evoexp.attachments import keep_all
from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition

sys.path.insert(0, str(Path(__file__).parents[1]))


def main() -> None:
    directory = Path(sys.argv[1])
    keep_all(path.read_bytes() for path in (directory / "files").iterdir())
    lines = (directory / "conditions").read_bytes().splitlines()
    print(json.dumps({key: found for line in lines for key, found in alone(line).items()}))
    for seed in sys.argv[2:]:
        order = random.Random(int(seed)).sample(lines, len(lines))
        print(json.dumps({key: found for line in order for key, found in result(line).items()}))


def result(line: bytes) -> dict[str, str]:
    """Run replicate 0 of a condition here."""
    from masked_logs import masked_log

    condition = Condition.from_json(line)
    content = run_replicate(condition, 0).content
    return {condition.id: hashlib.sha256(masked_log(content)).hexdigest()}


def alone(line: bytes) -> dict[str, str]:
    """Run it in a process in which nothing else ran."""
    reader, writer = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=lambda: writer.send(result(line)))
    process.start()
    writer.close()
    found: dict[str, str] = reader.recv()
    process.join()
    return found


if __name__ == "__main__":
    main()
