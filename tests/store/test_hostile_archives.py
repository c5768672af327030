"""Archives made to harm: refused in one line, in little memory, before anything is taken in."""

import functools
import io
import tarfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from store_samples import CONDITION, CONFIG, generations, write

from confinement import confined
from evoexp.store.archive import ArchiveError, take_in
from evoexp.store.log_bounds import MAX_LOG
from evoexp.store.run_directory import RunDirectory

ROOT = f"runs/{CONDITION[:12]}"
LITTLE = 200  # [MiB] beyond what the process has
LOG = f"{ROOT}/replicates/0007.mcap"


def entry(name: str, size: int = 0, kind: bytes = tarfile.REGTYPE) -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.size, info.type = size, kind
    return info


def packed(*entries: tuple[tarfile.TarInfo, bytes]) -> bytes:
    """Return an archive of a run, then these heads, each with the content behind it."""
    heads = [(entry(f"{ROOT}/config.json", len(CONFIG)), CONFIG), *entries]
    parts = []
    for info, content in heads:
        parts += [info.tobuf(tarfile.GNU_FORMAT), content, bytes(-len(content) % 512)]
    return b"".join(parts) + bytes(1024)


def sparse() -> bytes:
    """Return an archive of a log of 100 MB, of which a file holds nothing."""
    head = bytearray(entry(LOG, 512, tarfile.GNUTYPE_SPARSE).tobuf(tarfile.GNU_FORMAT))
    head[386:410] = b"%011o\0" % 0 + b"%011o\0" % 512  # the first piece that is there
    head[483:495] = b"%011o\0" % 100_000_000  # the size that the file is said to have
    head[148:156] = b"%06o\0 " % (sum(head[:148]) + sum(head[156:]) + 8 * 32)
    return packed()[:-1024] + bytes(head) + bytes(512) + bytes(1024)


def pax(**values: str) -> bytes:
    """Return an archive with an extended head before a log."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w", format=tarfile.PAX_FORMAT) as archive:
        config = entry(f"{ROOT}/config.json", len(CONFIG))
        archive.addfile(config, io.BytesIO(CONFIG))
        log = entry(LOG, 4)
        log.pax_headers = values
        archive.addfile(log, io.BytesIO(b"1234"))
    return stream.getvalue()


def plain(name: str, size: int = 0, kind: bytes = tarfile.REGTYPE) -> bytes:
    return packed((entry(name, size, kind), b""))


HOSTILE: dict[str, tuple[Callable[[], bytes], str]] = {
    "a sparse log": (sparse, "no regular file"),
    "PAX: a sparse log": (
        lambda: pax(**{"GNU.sparse.major": "1", "GNU.sparse.realsize": "99999999"}),
        "no regular file",
    ),
    "PAX: a size": (lambda: pax(size="99999999"), "no regular file"),
    "PAX: a path": (lambda: pax(path="../../evil"), "no regular file"),
    "a global PAX head": (lambda: plain("x", 0, tarfile.XGLTYPE), "no regular file"),
    "a PAX head of 8 GB": (lambda: plain("x", 2**33 - 1, tarfile.XHDTYPE), "no regular file"),
    "a long name of 8 GB": (
        lambda: plain("x", 2**33 - 1, tarfile.GNUTYPE_LONGNAME),
        "no regular file",
    ),
    "a link": (lambda: plain(LOG, 0, tarfile.SYMTYPE), "no regular file"),
    "a hard link": (lambda: plain(LOG, 0, tarfile.LNKTYPE), "no regular file"),
    "a device": (lambda: plain(LOG, 0, tarfile.CHRTYPE), "no regular file"),
    "a pipe": (lambda: plain(LOG, 0, tarfile.FIFOTYPE), "no regular file"),
    "a folder": (lambda: plain(f"{ROOT}/", 0, tarfile.DIRTYPE), "no regular file"),
    "an unknown kind": (lambda: plain(LOG, 0, b"Z"), "no regular file"),
    "a log larger than any": (lambda: plain(LOG, MAX_LOG + 1), "a file is too large"),
    "a manifest larger than any": (
        lambda: plain(f"{ROOT}/manifest.json", 10**7),
        "a file is too large",
    ),
    "a size below zero": (lambda: plain(LOG, -1), "a file is too large"),
    "a log larger than the archive": (lambda: plain(LOG, 10**8), "it is cut off"),
    "twice the same": (
        lambda: packed(*[(entry(f"{ROOT}/plans.json", 2), b"{}")] * 2),
        "plans.json twice",
    ),
    "two configurations": (
        lambda: packed((entry(f"{ROOT}/config.json", len(CONFIG)), CONFIG)),
        "config.json twice",
    ),
    "a path upwards": (lambda: plain(f"{ROOT}/../x.json"), "holds 'runs/"),
    "an absolute path": (lambda: plain("/tmp/x"), "holds '/tmp/x'"),
    "a name of two lines": (lambda: plain(f"{ROOT}/config.json\nx"), r"config.json\nx'"),
    "a line's end behind a name": (lambda: plain(f"{ROOT}/plans.json\n"), r"plans.json\n'"),
    "another folder": (lambda: plain(f"{ROOT}/files/x"), "holds 'runs/"),
    "a table": (lambda: plain(f"{ROOT}/summary.parquet"), "holds 'runs/"),
    "a file that no configuration names": (
        lambda: packed((entry(f"{ROOT}/files/{'0' * 64}", 1), b"x")),
        "does not have the hash that is its name",
    ),
    "a manifest that is no object": (
        lambda: packed((entry(f"{ROOT}/manifest.json", 2), b"[]")),
        "manifest.json of run",
    ),
    "one block at its end": (lambda: packed()[:-512], "it is cut off"),
    "another head at its end": (lambda: packed()[:-512] + b"x" * 512, "it is cut off"),
    "a cut head": (lambda: packed()[:600], "it is cut off"),
    "a wrong checksum": (lambda: b"x" + packed()[1:], "no archive of runs ("),
    "gzip": (lambda: b"\x1f\x8b" + bytes(1024), "compressed (gzip); unpack it"),
    "xz": (lambda: b"\xfd7zXZ\0" + bytes(1024), "compressed (xz); unpack it"),
    "zstd": (lambda: b"\x28\xb5\x2f\xfd" + bytes(1024), "compressed (zstd); unpack it"),
    "zip": (lambda: b"PK\x03\x04" + bytes(1024), "compressed (zip); unpack it"),
    "nothing": (lambda: b"", "it is cut off"),
    "no run": (lambda: bytes(1024), "it is empty"),
}


def refusal(content: bytes, folder: Path) -> str:
    """Return the line in which an archive is refused; of its runs nothing but folders is there."""
    path = folder / "runs.tar"
    path.write_bytes(content)
    with pytest.raises(ArchiveError) as refused:
        take_in(path, folder / "there")
    assert not list((folder / "there").rglob("*.mcap"))
    assert not (folder / "evil").exists()
    return str(refused.value)


@pytest.mark.parametrize("what", HOSTILE)
def test_it_is_refused_in_one_line_and_little_memory(what: str, tmp_path: Path) -> None:
    make, reason = HOSTILE[what]
    content = make()
    assert len(content) < 100_000
    text = confined(functools.partial(refusal, content, tmp_path), tmp_path, LITTLE)
    assert reason in text and text.isprintable() and len(text) < 400


def test_a_sample_is_taken_in(tmp_path: Path) -> None:
    """What is refused above is refused for its fault alone."""
    log = write(generations(4)).content
    (tmp_path / "runs.tar").write_bytes(packed((entry(LOG, len(log)), log)))
    (taken,) = take_in(tmp_path / "runs.tar", tmp_path / "there")
    assert (taken.added, taken.run.completed()) == (1, {7})


def larger(log: bytes) -> Iterator[tuple[tarfile.TarInfo, bytes]]:
    for replicate in range(7, 60):
        yield entry(f"{ROOT}/replicates/{replicate:04d}.mcap", len(log)), log


def test_many_large_files_take_the_memory_of_one(tmp_path: Path) -> None:
    """Sixty files of 8 MB that are no logs: the first one is refused, the others never read."""
    path = tmp_path / "runs.tar"
    path.write_bytes(packed(*larger(bytes(8_000_000))))

    def attempt() -> str:
        with pytest.raises(ArchiveError) as refused:
            take_in(path, tmp_path / "there")
        return str(refused.value)

    assert "replicate 7: log: not an MCAP" in confined(attempt, tmp_path, LITTLE)


def test_the_plans_of_an_archive_may_ask_for_any_number(tmp_path: Path) -> None:
    """A number that nobody could count up to costs no memory where the run is looked at."""
    from evoexp.store.integrity import check_run

    plans = b'{"plans": [{"num_replicates": 1000000000000000, "stored": 0}]}'
    log = write(generations(4)).content
    whole = packed((entry(f"{ROOT}/plans.json", len(plans)), plans), (entry(LOG, len(log)), log))
    (tmp_path / "runs.tar").write_bytes(whole)
    take_in(tmp_path / "runs.tar", tmp_path / "there")

    def lost() -> str:
        return check_run(tmp_path / "there", CONDITION[:12]).problems["replicates"]

    expected = "missing: 0, 1, 2 and 999999999999996 more of 1000000000000000 replicates"
    assert confined(lost, tmp_path, LITTLE).startswith(expected)
    assert RunDirectory(tmp_path / "there", CONDITION).completed() == {7}
