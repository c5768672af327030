"""Archives of runs: the same bytes for the same runs, and refusals of what is not whole."""

import functools
import io
import tarfile
from pathlib import Path

import pytest
from store_samples import CONDITION, CONFIG, generations, write

from confinement import confined
from evoexp.store.archive import ArchiveError, pack, take_in
from evoexp.store.identity import manifest
from evoexp.store.integrity import check_run
from evoexp.store.log import MAX_LOG
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory

URDF = Path(__file__).parent / "data" / "urdf.mcap"
ROOT = f"runs/{CONDITION[:12]}"
LOG = f"{ROOT}/replicates/0007.mcap"
LITTLE = 200  # [MiB] beyond what the process has
CONTENT = write(generations(4)).content
Entry = tuple[tarfile.TarInfo, bytes]


def stored(outputs: Path, condition_id: str, config: bytes, logs: dict[int, bytes]) -> RunDirectory:
    """Return a run whose attached files are those of its first log."""
    run = RunDirectory(outputs, condition_id)
    attached = read_log(next(iter(logs.values()))).attachments
    files = {name: content for name, content in attached.items() if "files/" in name}
    run.create(config, manifest(condition_id), files)
    run.note_plan(len(logs))
    run.write_logs(logs)
    return run


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[RunDirectory]:
    """Return a run of two replicates, and a stored one of a robot out of a URDF."""
    outputs, urdf = tmp_path_factory.mktemp("packed"), read_log(URDF)
    logs = {k: write(generations(6), k).content for k in range(2)}
    with_files = {urdf.replicate: URDF.read_bytes()}
    return [
        stored(outputs, CONDITION, CONFIG, logs),
        stored(outputs, urdf.condition_id, urdf.config_json, with_files),
    ]


def test_runs_travel_whole_and_the_same_runs_give_the_same_bytes(
    runs: list[RunDirectory], tmp_path: Path
) -> None:
    one, two, there = tmp_path / "one.tar", tmp_path / "two.tar", tmp_path / "there"
    assert pack(runs, one) == pack(runs[::-1], two) == 3
    assert one.read_bytes() == two.read_bytes()
    taken = take_in(one, there)
    assert sorted(each.run.condition_id for each in taken) == sorted(r.condition_id for r in runs)
    for run in runs:
        other = RunDirectory(there, run.condition_id)
        assert other.config_json() == run.config_json() and other.plans() == run.plans()
        for replicate in run.completed():
            assert other.log_path(replicate).read_bytes() == run.log_path(replicate).read_bytes()
    RunDirectory(there, CONDITION).log_path(1).unlink()
    time = RunDirectory(there, CONDITION).log_path(0).stat().st_mtime_ns
    again = take_in(one, there)
    assert sorted((each.added, each.kept) for each in again) == [(0, 1), (1, 1)]
    assert RunDirectory(there, CONDITION).log_path(0).stat().st_mtime_ns == time


def entry(name: str, content: bytes = b"", size: int | None = None, kind: bytes = b"0") -> Entry:
    """Return the head of a file and what follows it; the head may tell another size."""
    info = tarfile.TarInfo(name)
    info.size, info.type = len(content) if size is None else size, kind
    return info, content


CONFIGURATION = entry(f"{ROOT}/config.json", CONFIG)


def packed(*entries: Entry, before: tuple[Entry, ...] = (CONFIGURATION,)) -> bytes:
    """Return an archive of a configuration, then other files."""
    parts = []
    for info, content in (*before, *entries):
        parts += [info.tobuf(tarfile.GNU_FORMAT), content, bytes(-len(content) % 512)]
    return b"".join(parts) + bytes(1024)


def claimed(name: str, size: int = 0, kind: bytes = tarfile.REGTYPE) -> bytes:
    """Return an archive with a head that nothing follows."""
    return packed(entry(name, size=size, kind=kind))


def sparse() -> bytes:
    """Return an archive of a log of 100 MB, of which a file holds nothing."""
    info, _ = entry(LOG, size=512, kind=tarfile.GNUTYPE_SPARSE)
    head = bytearray(info.tobuf(tarfile.GNU_FORMAT))
    head[386:410] = b"%011o\0" % 0 + b"%011o\0" % 512  # the first piece that is there
    head[483:495] = b"%011o\0" % 100_000_000  # the size that the file is said to have
    head[148:156] = b"%06o\0 " % (sum(head[:148]) + sum(head[156:]) + 8 * 32)
    return packed()[:-1024] + bytes(head) + bytes(512) + bytes(1024)


def pax(**values: str) -> bytes:
    """Return an archive with an extended head before a log."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for info, content in (CONFIGURATION, entry(LOG, b"1234")):
            info.pax_headers = values if info.name == LOG else {}
            archive.addfile(info, io.BytesIO(content))
    return stream.getvalue()


def flipped(content: bytes) -> bytes:
    at = len(content) // 2
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


HOSTILE: dict[str, dict[str, bytes]] = {  # the reason → what is wrong → the archive
    "no regular file": {
        "a sparse log": sparse(),
        "PAX, a sparse log": pax(**{"GNU.sparse.major": "1", "GNU.sparse.realsize": "99999999"}),
        "PAX, a size": pax(size="99999999"),
        "PAX, a path": pax(path="../../evil"),
        "a global PAX head": claimed("x", 0, tarfile.XGLTYPE),
        "a PAX head of 8 GB": claimed("x", 2**33 - 1, tarfile.XHDTYPE),
        "a long name of 8 GB": claimed("x", 2**33 - 1, tarfile.GNUTYPE_LONGNAME),
        "a link": claimed(LOG, 0, tarfile.SYMTYPE),
        "a hard link": claimed(LOG, 0, tarfile.LNKTYPE),
        "a device": claimed(LOG, 0, tarfile.CHRTYPE),
        "a pipe": claimed(LOG, 0, tarfile.FIFOTYPE),
        "a folder": claimed(f"{ROOT}/", 0, tarfile.DIRTYPE),
        "an unknown kind": claimed(LOG, 0, b"Z"),
    },
    "a file is too large": {
        "a log larger than any": claimed(LOG, MAX_LOG + 1),
        "a manifest larger than any": claimed(f"{ROOT}/manifest.json", 10**7),
        "a size below zero": claimed(LOG, -1),
    },
    "it is cut off": {
        "a log larger than the archive": claimed(LOG, 10**8),
        "one block at its end": packed()[:-512],
        "another head at its end": packed()[:-512] + b"x" * 512,
        "a cut head": packed()[:600],
        "a cut log": packed(entry(LOG, CONTENT))[:-2048],
        "nothing": b"",
    },
    "no archive of runs: holds ": {
        "a path upwards": claimed(f"{ROOT}/../x.json"),
        "a path upwards from the store": packed(entry("../evil"), before=()),
        "an absolute path": claimed("/tmp/x"),
        "colours in a name": claimed("runs/x\x1b[31m"),
        "another folder": claimed(f"{ROOT}/files/x"),
        "a table": claimed(f"{ROOT}/summary.parquet"),
    },
    r"config.json\nx'": {"a name of two lines": claimed(f"{ROOT}/config.json\nx")},
    r"plans.json\n'": {"a line's end behind a name": claimed(f"{ROOT}/plans.json\n")},
    "plans.json twice": {"twice the same": packed(*[entry(f"{ROOT}/plans.json", b"{}")] * 2)},
    "config.json twice": {"two configurations": packed(CONFIGURATION)},
    "does not have the hash that is its name": {
        "a file that no configuration names": packed(entry(f"{ROOT}/files/{'0' * 64}", b"x")),
    },
    "manifest.json of run": {"no object": packed(entry(f"{ROOT}/manifest.json", b"[]"))},
    "replicate 7: log: ": {"a flipped byte": packed(entry(LOG, flipped(CONTENT)))},
    "which does not belong here": {
        "a log in the place of another": packed(entry(LOG.replace("7.", "8."), CONTENT)),
    },
    "has another hash": {"another configuration": packed(before=(entry(f"{ROOT}/config.json"),))},
    "is without config.json": {"no configuration": packed(entry(LOG, CONTENT), before=())},
    "no archive of runs (": {"a wrong checksum": b"x" + packed()[1:]},
    "it is empty": {"no run": bytes(1024)},
    **{
        f"compressed ({name}); unpack it": {name: sign + bytes(1024)}
        for name, sign in (("gzip", b"\x1f\x8b"), ("xz", b"\xfd7zXZ\0"), ("zip", b"PK\x03\x04"))
    },
    "compressed (zstd); unpack it": {"zstd": b"\x28\xb5\x2f\xfd" + bytes(1024)},
}
CASES = [
    pytest.param(content, reason, id=what)
    for reason, archives in HOSTILE.items()
    for what, content in archives.items()
]


def refusal(path: Path) -> str:
    """Return the line in which an archive is refused; of its runs nothing but folders is there."""
    there = path.with_name("there")
    with pytest.raises(ArchiveError) as refused:
        take_in(path, there)
    assert not list(there.rglob("*.mcap")) and not list(there.rglob("*.tmp"))
    assert not path.with_name("evil").exists()
    return str(refused.value)


@pytest.mark.parametrize(("content", "reason"), CASES)
def test_a_hostile_archive_is_refused_in_one_line_and_little_memory(
    content: bytes, reason: str, tmp_path: Path
) -> None:
    assert len(content) < 100_000
    path = tmp_path / "runs.tar"
    path.write_bytes(content)
    text = confined(functools.partial(refusal, path), tmp_path, LITTLE)
    assert reason in text and text.isprintable() and len(text) < 400


def test_many_large_files_take_the_memory_of_one(tmp_path: Path) -> None:
    """Sixty files of 8 MB that are no logs: the first one is refused, the others never read."""
    path, log = tmp_path / "runs.tar", bytes(8_000_000)
    names = [f"{ROOT}/replicates/{replicate:04d}.mcap" for replicate in range(7, 60)]
    path.write_bytes(packed(*(entry(name, log) for name in names)))
    text = confined(functools.partial(refusal, path), tmp_path, LITTLE)
    assert "replicate 7: log: not an MCAP" in text


def test_the_plans_of_an_archive_may_ask_for_any_number(tmp_path: Path) -> None:
    """A number that nobody could count up to costs no memory where the run is looked at."""
    plans = b'{"plans": [{"num_replicates": 1000000000000000, "stored": 0}]}'
    (tmp_path / "runs.tar").write_bytes(
        packed(entry(f"{ROOT}/plans.json", plans), entry(LOG, CONTENT))
    )
    (taken,) = take_in(tmp_path / "runs.tar", tmp_path / "there")
    assert (taken.added, taken.run.completed()) == (1, {7}), "what is refused above has a fault"

    def lost() -> str:
        return check_run(tmp_path / "there", CONDITION[:12]).problems["replicates"]

    expected = "missing: 0, 1, 2 and 999999999999996 more of 1000000000000000 replicates"
    assert confined(lost, tmp_path, LITTLE).startswith(expected)
