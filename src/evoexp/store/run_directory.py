"""The directory of one condition, `runs/<hash12>/`: its place, its finished parts, its lock."""

import json
import os
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from evoexp.attachments import PREFIX, keep_all
from evoexp.errors import AmbiguousHash, Busy, StoreError, UnknownHash, nearest, portable
from evoexp.store import identity
from evoexp.store.files import reason, remove_stale, sync_directory, warn, write_file, write_files
from evoexp.store.identity import CONFIG, MANIFEST, PLANS, REPLICATES, DamagedFile, Plan

HASH_LENGTH = 12  # hex digits shown, and of a directory's name
COMMAND = "evoexp run experiment=…"  # runs a run whose own command nothing records
_RUN = COMMAND.split()[:2]
_LOG = re.compile(r"((?:[1-9][0-9]*)?[0-9]{4})\.mcap")
_FAILED = re.compile(r"((?:[1-9][0-9]*)?[0-9]{4})\.failed\.json")


class RunDirectory:
    """The directory of one condition's run, its files and its lock.

    Reading needs no lock. Every writing method is for the one process that holds `lock()`. The
    condition's id is the SHA-256 of `config.json`; its first twelve digits name the run.
    """

    def __init__(self, outputs: Path, condition_id: str) -> None:
        """Name the directory; nothing is created or read."""
        self.condition_id, self.hash12 = condition_id, condition_id[:HASH_LENGTH]
        self.path = Path(outputs) / "runs" / self.hash12
        self.replicates, self.summary_path = self.path / REPLICATES, self.path / "summary.parquet"
        self._lock = FileLock(self.path / ".lock", timeout=0)

    def log_path(self, replicate: int) -> Path:
        """Return where the finished log of a replicate is or will be."""
        return self.replicates / f"{replicate:04d}.mcap"

    def failure_path(self, replicate: int) -> Path:
        """Return where the reason of a failed replicate is or will be."""
        return self.replicates / f"{replicate:04d}.failed.json"

    def create(
        self,
        config_json: bytes,
        manifest: Mapping[str, Any],
        files: Mapping[str, bytes] | None = None,
    ) -> None:
        """Create what is missing; a configuration and manifest already there stay as they are.

        The files are the contents that the configuration refers to, see `attachments.attached`.
        """
        if (self.path / CONFIG).exists():
            self.check()
        text = json.dumps(manifest, indent=2, sort_keys=True).encode() + b"\n"
        # the configuration comes behind the files that it refers to
        contents = {**(files or {}), CONFIG: config_json, MANIFEST: text}
        paths = {self.path / name: content for name, content in contents.items()}
        missing = {path: content for path, content in paths.items() if not path.exists()}
        self.replicates.mkdir(parents=True, exist_ok=True)
        write_files(missing)
        sync_directory(self.path.parent)

    def check(self) -> None:
        """Raise StoreError unless `config.json` is this condition's; `DamagedFile` if damaged."""
        stored = identity.config_id(self.path)
        if stored != self.condition_id:
            raise StoreError(
                f"{self.path}: holds condition {stored}, which shares its first {HASH_LENGTH} "
                f"digits with {self.condition_id}; keep one of them in another EVOEXP_OUTPUTS"
            )

    def check_identity(self) -> None:
        """Raise where the directory is another condition's; a lost configuration is only said."""
        try:
            self.check()
        except DamagedFile as error:
            warn(f"{error}. Mend it: {self.command}")

    def config_json(self) -> bytes:
        """Return the canonical form of the condition, checked, and keep the files it refers to.

        Where one of them is lost, a log has it, which is said, or else StoreError is raised.
        """
        try:
            self.check()
            content = identity.read(self.path / CONFIG)
            lost = [path for path, _ in identity.lost_files(self.path, content)]
            if not lost:
                keep_all(map(identity.read, sorted((self.path / PREFIX).glob("[0-9a-f]*"))))
                return content
            error = StoreError(f"{lost[0]}: missing or damaged")
        except DamagedFile as damaged:
            error = damaged
        for name, log in identity.whole_logs(self.path, self.condition_id):
            warn(f"{error}; taken from {name}. Mend it: {self.command}")
            attached = log.attachments.items()
            keep_all(data for name, data in attached if name.startswith(PREFIX))
            return log.config_json
        raise error

    def manifest(self) -> dict[str, Any]:
        """Return the manifest that was written when the run was created; a lost one is empty."""
        try:
            return identity.checked_manifest(self.path, self.condition_id)
        except DamagedFile as error:
            warn(f"{error}. Mend it: {COMMAND}")
            return {}

    def origin(self) -> dict[str, Any]:
        """Return the origin of the run, see `identity.origin`; by its hash alone if need be."""
        return identity.origin(self.manifest(), self.condition_id)

    def damaged_files(self, config_json: bytes | None = None) -> dict[str, str]:
        """Return name → what is wrong with it, of the files beside the logs, see `check`.

        Without the canonical form of its condition, the stored one tells which files it needs.
        """
        if not is_stored(self.path):
            return {}
        damaged: dict[str, str] = {}
        if self.replicates.exists() and not self.replicates.is_dir():
            damaged[REPLICATES] = "damaged: not a directory"
        checks: dict[str, Callable[[], object]] = {
            CONFIG: self.check,
            MANIFEST: lambda: identity.checked_manifest(self.path, self.condition_id),
            PLANS: self.plans,
        }
        for name, check in checks.items():
            try:
                check()
            except DamagedFile as error:
                if name != MANIFEST or os.path.lexists(self.path / MANIFEST) or self.completed():
                    damaged[name] = reason(self.path / name, error)
        if config_json is None:
            config_json = b"" if CONFIG in damaged else identity.read(self.path / CONFIG)
        lost = identity.lost_files(self.path, config_json)
        return damaged | {str(path.relative_to(self.path)): why for path, why in lost}

    @property
    def command(self) -> str:
        """The command that runs the missing replicates, as the manifest has it.

        A manifest out of somebody's archive is not believed: its command is none to be typed.
        """
        try:
            notes = identity.checked_manifest(self.path, self.condition_id)
            words = shlex.split(str(notes.get("command") or ""))
        except (DamagedFile, ValueError):
            return COMMAND
        return shlex.join(words) if words[:2] == _RUN and identity.TAKEN not in notes else COMMAND

    def plans(self) -> list[Plan]:
        """Return how many replicates were asked for, in the order in which that was done."""
        path = self.path / PLANS
        if not os.path.lexists(path):
            return []
        try:
            rows = identity.read_object(path)["plans"]
            plans = [Plan(row["num_replicates"], row["stored"]) for row in rows]
        except (KeyError, TypeError) as error:
            raise DamagedFile(f"{path}: damaged: no list of plans") from error
        if not all(type(number) is int and number >= 0 for plan in plans for number in plan):
            raise DamagedFile(f"{path}: damaged: a plan is two whole numbers")
        return plans

    def num_asked(self) -> int:
        """Return how many replicates were ever asked for; 0 where the plans are damaged."""
        with suppress(DamagedFile):
            return max((plan.num_replicates for plan in self.plans()), default=0)
        return 0

    def num_planned(self, asked: int = 0) -> int:
        """Return how many replicates were ever asked for, now included, or are there."""
        return max([asked, self.num_asked(), *(1 + k for k in self.completed() | self.failed())])

    def note_plan(self, num_replicates: int) -> None:
        """Note that so many replicates are asked for, before any of them runs; more than ever."""
        plans = self.plans()
        if num_replicates > self.num_asked():
            plans.append(Plan(num_replicates, len(self.completed())))
            text = json.dumps({"plans": [plan._asdict() for plan in plans]}, indent=2)
            write_file(self.path / PLANS, text.encode() + b"\n")

    @staticmethod
    def is_own(name: str) -> bool:
        """Return whether a file's name is one of a log or a failure."""
        return bool(_LOG.fullmatch(name) or _FAILED.fullmatch(name))

    def completed(self) -> set[int]:
        """Return the replicates whose finished log is there."""
        return self._matching(_LOG)

    def failed(self) -> set[int]:
        """Return the replicates that failed and were not completed since."""
        return self._matching(_FAILED) - self.completed()

    def failure(self, replicate: int) -> dict[str, Any]:
        """Return `reason` and `traceback` of a failed replicate."""
        failure = identity.read_object(self.failure_path(replicate))
        if not all(isinstance(failure.get(name), str) for name in ("reason", "traceback")):
            raise StoreError(f"{self.failure_path(replicate)}: damaged: no reason and traceback")
        return failure

    def write_logs(self, contents: Mapping[int, bytes]) -> None:
        """Keep finished logs: their replicates are completed, whatever failed before."""
        write_files({self.log_path(k): content for k, content in contents.items()})
        for replicate in contents:
            self.failure_path(replicate).unlink(missing_ok=True)

    def write_failure(self, replicate: int, reason: str, traceback: str) -> None:
        """Keep why a replicate failed, a line and the traceback, without this machine's folders."""
        reason, traceback = map(portable, (reason, traceback))
        failure = {"replicate": replicate, "reason": reason, "traceback": traceback}
        write_file(self.failure_path(replicate), json.dumps(failure, indent=2).encode() + b"\n")

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Hold the run for writing; an operating-system lock that dies with its process.

        The same object may lock again inside. Temporary files that a killed parent left are
        removed. `Busy` is raised where another process or object holds the run.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        try:
            held = self._lock.acquire()
        except Timeout:
            text = f"run {self.hash12}: another process is writing it now ({self.path})"
            raise Busy(text) from None
        with held:
            remove_stale((self.path, self.replicates))
            yield

    def is_being_written(self) -> bool:
        """Return whether another process holds the lock of the run; it is free again at once."""
        try:
            if (self.path / ".lock").exists():
                with FileLock(self.path / ".lock", timeout=0):
                    return False
        except OSError as error:  # others are of outputs that may only be read
            return isinstance(error, Timeout)
        return False

    def _matching(self, pattern: re.Pattern[str]) -> set[int]:
        try:
            names = os.listdir(self.replicates)
        except (FileNotFoundError, NotADirectoryError):
            return set()
        return {int(match[1]) for name in names if (match := pattern.fullmatch(name))}


@contextmanager
def lock_all(runs: Iterable[RunDirectory]) -> Iterator[None]:
    """Hold several runs; in the order of their hashes, so that no two processes wait in a ring."""
    with ExitStack() as stack:
        distinct = {run.path: run for run in runs}.values()
        for run in sorted(distinct, key=lambda run: run.condition_id):
            stack.enter_context(run.lock())
        yield


def outputs_root() -> Path:
    """Return the root of all outputs: `EVOEXP_OUTPUTS`, or `outputs` in the current directory."""
    return Path(os.environ.get("EVOEXP_OUTPUTS") or "outputs")


def open_run(outputs: Path, name: str) -> RunDirectory:
    """Return a stored run by its directory's name; StoreError: nothing there knows its hash."""
    path = Path(outputs) / "runs" / name
    try:
        return RunDirectory(outputs, identity.stored_id(path))
    except OSError as error:
        raise StoreError(f"{path}: cannot be read: {error.strerror or error}") from error


def resolve(outputs: Path, prefix: str) -> RunDirectory:
    """Return the one stored run whose hash begins with a prefix, or raise UnknownHash."""
    digits = prefix.lower()
    if not re.fullmatch("[0-9a-f]{1,64}", digits):
        raise UnknownHash(f"hash: must be 1 to 64 hexadecimal digits, was '{prefix}'")
    names = run_names(outputs)
    candidates = [name for name in names if name.startswith(digits[:HASH_LENGTH])]
    if len(candidates) > 1:
        raise AmbiguousHash(prefix, candidates)
    if candidates and (run := open_run(outputs, candidates[0])).condition_id.startswith(digits):
        return run
    hint = nearest(digits[:HASH_LENGTH], [name[: len(digits)] for name in names])
    raise UnknownHash(f"hash: no run '{prefix}' among the {len(names)} in {outputs}{hint}")


def run_names(outputs: Path) -> list[str]:
    """Return the names of the directories that hold a run, sorted; damaged ones included."""
    runs = Path(outputs) / "runs"
    names = (path.name for path in runs.glob("[0-9a-f]" * HASH_LENGTH))
    return sorted(name for name in names if is_stored(runs / name))


def is_stored(path: Path) -> bool:
    """Return whether a directory holds anything of a run; a killed parent may leave it empty."""
    try:
        if (path / CONFIG).exists() or (path / MANIFEST).exists():
            return True
    except PermissionError:
        return True
    return any(_LOG.fullmatch(each.name) for each in path.glob(f"{REPLICATES}/*.mcap"))
