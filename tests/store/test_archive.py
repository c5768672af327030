"""Archives of runs: packed the same, taken in checked, and refused where they are not whole."""

import io
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest

from evoexp.batch.replicate import run_replicate
from evoexp.configuration import compose
from evoexp.store.archive import ArchiveError, pack, take_in
from evoexp.store.log_reader import read_log
from evoexp.store.manifest import manifest
from evoexp.store.run_directory import RunDirectory

SMALL = ["budget=smoke", "ga.population_size=8", "ga.num_generations=2"]
URDF = Path(__file__).parent / "data" / "urdf.mcap"
Entries = list[tuple[str, bytes]]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[RunDirectory]:
    """Return a run of two replicates, and a stored one of a robot out of a URDF."""
    outputs = tmp_path_factory.mktemp("packed")
    condition = compose.expand(["experiment=rana_planar", *SMALL])[0].conditions[0].condition
    run = RunDirectory(outputs, condition.id)
    run.create(condition.to_json(), manifest(condition.id))
    run.note_plan(2)
    run.write_logs({k: run_replicate(condition, k).content for k in range(2)})
    stored = read_log(URDF)
    files = {name: content for name, content in stored.attachments.items() if "files/" in name}
    of_urdf = RunDirectory(outputs, stored.condition_id)
    of_urdf.create(stored.config_json, manifest(stored.condition_id), files)
    of_urdf.note_plan(1)
    of_urdf.write_logs({stored.replicate: URDF.read_bytes()})
    return [run, of_urdf]


def entries(path: Path) -> Entries:
    with tarfile.open(path) as archive:
        return [(each.name, archive.extractfile(each).read()) for each in archive]  # type: ignore[union-attr]


def written(path: Path, found: Entries) -> Path:
    with tarfile.open(path, "w") as archive:
        for name, content in found:
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return path


def test_runs_travel_whole_and_the_same_runs_give_the_same_bytes(
    runs: list[RunDirectory], tmp_path: Path
) -> None:
    one, two = tmp_path / "one.tar", tmp_path / "two.tar"
    assert pack(runs, one) == pack(runs[::-1], two) == 3
    assert one.read_bytes() == two.read_bytes()
    taken = take_in(one, tmp_path / "there")
    assert sorted(each.run.condition_id for each in taken) == sorted(r.condition_id for r in runs)
    for run in runs:
        other = RunDirectory(tmp_path / "there", run.condition_id)
        assert other.config_json() == run.config_json() and other.plans() == run.plans()
        for replicate in run.completed():
            assert other.log_path(replicate).read_bytes() == run.log_path(replicate).read_bytes()
    again = take_in(one, tmp_path / "there")
    assert sorted((each.added, each.kept) for each in again) == [(0, 1), (0, 2)]


def test_replicates_that_are_there_stay(runs: list[RunDirectory], tmp_path: Path) -> None:
    path = tmp_path / "runs.tar"
    pack(runs[:1], path)
    other = RunDirectory(tmp_path / "there", runs[0].condition_id)
    other.create(runs[0].config_json(), manifest(runs[0].condition_id))
    other.write_logs({0: runs[0].log_path(0).read_bytes()})
    time = other.log_path(0).stat().st_mtime_ns
    (taken,) = take_in(path, tmp_path / "there")
    assert (taken.added, taken.kept) == (1, 1)
    assert other.log_path(0).stat().st_mtime_ns == time


def _flip(content: bytes) -> bytes:
    at = len(content) // 2
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def _swap(found: Entries) -> Entries:
    logs = [k for k, (name, _) in enumerate(found) if name.endswith(".mcap")]
    a, b = logs[:2]
    found[a], found[b] = (found[a][0], found[b][1]), (found[b][0], found[a][1])
    return found


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda found: [(n, _flip(c) if "mcap" in n else c) for n, c in found], "damaged: "),
        (_swap, "which does not belong here"),
        (lambda found: [(n, _flip(c) if "config" in n else c) for n, c in found], "another hash"),
        (lambda found: found[1:], "comes before config.json"),
        (lambda found: [("../evil", b"")], "no archive of runs: holds '../evil'"),
        (lambda found: [("/etc/passwd", b"")], "no archive of runs: holds "),
        (lambda found: [*found, ("runs/x\x1b[31m", b"")], "no archive of runs: holds "),
        (lambda found: [], "it is empty"),
    ],
)
def test_what_is_not_whole_is_refused_in_one_line(
    change: Callable[[Entries], Entries], reason: str, runs: list[RunDirectory], tmp_path: Path
) -> None:
    pack(runs[:1], tmp_path / "runs.tar")
    path = written(tmp_path / "changed.tar", change(entries(tmp_path / "runs.tar")))
    with pytest.raises(ArchiveError) as refused:
        take_in(path, tmp_path / "there")
    text = str(refused.value)
    assert reason in text and "\n" not in text and "\x1b" not in text
    assert not (tmp_path / "evil").exists()
    logs = list((tmp_path / "there").rglob("*.mcap"))
    assert all(read_log(log) for log in logs)  # only whole ones arrive
    assert not list((tmp_path / "there").rglob("*.tmp"))


def test_links_and_cut_files_are_refused(runs: list[RunDirectory], tmp_path: Path) -> None:
    path = tmp_path / "link.tar"
    with tarfile.open(path, "w") as archive:
        entry = tarfile.TarInfo(f"runs/{runs[0].hash12}/config.json")
        entry.type, entry.linkname = tarfile.SYMTYPE, "/etc/passwd"
        archive.addfile(entry)
    with pytest.raises(ArchiveError, match="no regular file"):
        take_in(path, tmp_path / "there")
    pack(runs[:1], tmp_path / "runs.tar")
    content = (tmp_path / "runs.tar").read_bytes()
    for share in (0.1, 0.5, 0.8):
        path.write_bytes(content[: int(share * len(content))])
        with pytest.raises(ArchiveError):
            take_in(path, tmp_path / f"there {share}")
    path.write_bytes(b"no archive at all" * 100)
    with pytest.raises(ArchiveError, match="no archive of runs"):
        take_in(path, tmp_path / "there")
