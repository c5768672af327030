"""Where compiled kernels are kept: by content, not by place or time."""

import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp.numeric import code_keys, compiled_kinds, kept_files, kernel_cache, kernel_files
from evoexp.numeric.compilation import kernel
from evoexp.numeric.kernel_cache import code_key


def test_words_are_no_part_of_a_module_and_code_is() -> None:
    code = b"import evoexp.records\ndef f(x):\n    return x + 1\n"
    worded = b"""'''About f.'''
import evoexp.records  # types


def f(x: int) -> int:
    # one more
    '''Add one.'''
    return x + 1
"""
    plain = code_keys.parse(code, "evoexp")
    assert code_keys.parse(worded, "evoexp") == plain
    assert plain.imports == ("evoexp.records",)
    assert code_keys.parse(code.replace(b"+ 1", b"+ 2"), "evoexp").digest != plain.digest


def test_a_module_is_known_by_all_code_that_it_imports(monkeypatch: pytest.MonkeyPatch) -> None:
    reached = code_keys._reached("evoexp.planners.via_point_ga.planner")
    assert {
        "evoexp.collision.models.sphere_kernels",
        "evoexp.numeric.elementary",
        "evoexp.planners.via_point_ga.kernels",
    } <= reached
    assert "evoexp.planners.coevolution.kernels" not in reached
    before = code_keys.module_key.__wrapped__("evoexp.paths.spline")
    other = code_keys.Source("changed", ())
    source_of = code_keys._source_of
    monkeypatch.setattr(
        code_keys,
        "_source_of",
        lambda name: other if name == "evoexp.numeric.compilation" else source_of(name),
    )
    assert code_keys.module_key.__wrapped__("evoexp.paths.spline") != before


def test_kernels_are_kept_by_content_not_by_place(tmp_path: Path) -> None:
    """Two copies of one guest package share what one of them compiled; edited code does not."""
    code = "from evoexp.numeric.compilation import kernel\n@kernel\ndef f(x):\n    return x + 1.0\n"
    call = "import guest; guest.f(1.0); print(sum(guest.f.stats.cache_hits.values()))"

    def hits(place: str, text: str) -> int:
        (tmp_path / place).mkdir(exist_ok=True)
        (tmp_path / place / "guest.py").write_text(text)
        paths = [str(tmp_path / place), str(Path(kernel_cache.__file__).parents[2])]
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "EVOEXP_CACHE": str(tmp_path / "cache"),
        }
        command = [sys.executable, "-c", call]
        return int(subprocess.check_output(command, env=environment, text=True))

    assert hits("one", code) == 0
    assert hits("two", "# moved down\n\n" + code) == 1
    assert hits("one", code.replace("1.0", "2.0")) == 0


def test_functions_of_one_name_are_told_apart() -> None:
    one, two = kernel(lambda x: x + 1.0), kernel(lambda x: x + 2.0)
    other = kernel(lambda x: math.sqrt(x)), kernel(lambda x: math.floor(x))
    assert (one(0.5), two(0.5), other[0](0.25), other[1](0.25)) == (1.5, 2.5, 0.5, 0.0)
    # an edit of words is none of the code
    same = code_key(lambda x: x + 1.0)
    assert code_key(lambda x: x + 1.0) == same != code_key(lambda x: x + 2.0)


GUEST = "from evoexp.numeric.compilation import kernel\n@kernel\ndef f(x):\n    return x + 1.0\n"


def call_guest(tmp_path: Path, cache: Path) -> subprocess.CompletedProcess[str]:
    """Call a guest's kernel in a process of its own; print the result and the cache's hits."""
    (tmp_path / "guest.py").write_text(GUEST)
    paths = [str(tmp_path), str(Path(kernel_cache.__file__).parents[2])]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(paths),
        "EVOEXP_CACHE": str(cache),
    }
    call = "import guest; print(guest.f(1.0), sum(guest.f.stats.cache_hits.values()))"
    command = [sys.executable, "-c", call]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True)


def test_damaged_kernels_are_compiled_again_and_that_is_said_once(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    assert call_guest(tmp_path, cache).stdout == "2.0 0\n"
    for path in cache.rglob("*"):  # sources and kernels
        if path.is_file() and path.suffix != ".lock":
            content = bytearray(path.read_bytes())
            content[len(content) // 2] ^= 1
            path.write_bytes(content)
    done = call_guest(tmp_path, cache)
    assert done.stdout == "2.0 0\n"
    assert done.stderr.count("\n") == 1
    assert "damaged" in done.stderr
    done = call_guest(tmp_path, cache)
    assert (done.stdout, done.stderr) == ("2.0 1\n", "")


def test_where_kernels_cannot_be_kept_they_are_compiled_and_that_is_said_once(
    tmp_path: Path,
) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    (cache / "kernels").touch()
    done = call_guest(tmp_path, cache)
    assert done.stdout == "2.0 0\n"
    assert done.stderr.count("\n") == 1
    assert done.stderr.endswith("Not a directory; kernels are not kept\n")


def test_what_is_compiled_is_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel_files, "USED", set())
    modules = ("evoexp.paths.spline",)
    assert not compiled_kinds.is_compiled("a planner", modules)
    compiled_kinds.note_compiled("a planner", modules)
    assert compiled_kinds.is_compiled("a planner", modules)
    assert not compiled_kinds.is_compiled("another", modules)
    assert not compiled_kinds.is_compiled("a planner", ("evoexp.paths.walk",))
    monkeypatch.setattr(compiled_kinds, "_note", lambda *_: Path("/dev/null/no"))
    compiled_kinds.note_compiled("a planner", modules)  # cannot be written: no error


def test_what_was_compiled_counts_no_longer_when_a_kernel_is_gone_or_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel_files, "USED", used := set[Path]())
    monkeypatch.setattr(kept_files.MESSAGES, "_said", set())
    folder = tmp_path / "cache" / "kernels" / "module" / "key"
    kernel_files.KernelFiles(folder, "f").save("double", b"code")
    assert len(used) == 2

    def is_compiled() -> bool:
        compiled_kinds._is_whole.cache_clear()  # as in another process
        return compiled_kinds.is_compiled("a planner", ())

    for each in ("f.nbi", next(folder.glob("*.nbc")).name):
        whole = (folder / each).read_bytes()
        compiled_kinds.note_compiled("a planner", ())
        assert is_compiled()
        (folder / each).write_bytes(whole[:-1])
        assert not is_compiled()
        (folder / each).unlink()
        assert not is_compiled()
        (folder / each).write_bytes(whole)
    assert capsys.readouterr().err.count("\n") == 1
    (note,) = (tmp_path / "cache" / "compiled").iterdir()
    note.write_bytes(note.read_bytes()[:-1])
    assert not is_compiled()


def test_old_states_go_but_recent_and_used_ones_stay(tmp_path: Path) -> None:
    states = [tmp_path / f"{age:016x}" for age in range(8)]
    for age, state in enumerate(states):
        (state / "evoexp_0").mkdir(parents=True)
        os.utime(state, (1e9 - age, 1e9 - age))
    os.utime(states[6])
    kernel_cache._remove_old(states[7])  # used just now: the newest
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {states[i].name for i in (7, 6, 0, 1)}
    kernel_cache._remove_old(tmp_path / "file" / "nothing")  # silent where nothing is there


EDITED = """
import pathlib, sys
from guest.kernels import f  # its code is loaded, nothing is compiled
constants = pathlib.Path(sys.argv[1])
constants.write_text(constants.read_text().replace("1.0", "5.0"))
print(f(1.0))
"""


def test_code_that_is_edited_while_it_runs_leaves_no_stale_kernel(tmp_path: Path) -> None:
    """The kernel of the loaded code would be kept under the key of the edited one."""
    package = tmp_path / "guest"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "constants.py").write_text("ADDED = 1.0\n")
    code = GUEST.replace("1.0", "ADDED").replace("\n@", "\nfrom guest.constants import ADDED\n@")
    (package / "kernels.py").write_text(code)
    paths = [str(tmp_path), str(Path(kernel_cache.__file__).parents[2])]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(paths),
        "EVOEXP_CACHE": str(tmp_path / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }

    def said(script: str) -> tuple[str, str]:
        command = [sys.executable, "-c", script, str(package / "constants.py")]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return done.stdout, done.stderr

    assert said(EDITED) == ("2.0\n", "")
    call = "from guest.kernels import f; print(f(1.0), sum(f.stats.cache_hits.values()))"
    assert said(call) == ("6.0 0\n", "")
    assert said(call) == ("6.0 1\n", "")


def test_a_folder_without_init_keeps_no_kernel_of_an_edited_callee(tmp_path: Path) -> None:
    folder = tmp_path / "loose"
    folder.mkdir()
    head = "from evoexp.numeric.compilation import kernel\n"
    (folder / "outer.py").write_text(
        f"{head}from loose.inner import g\n@kernel\ndef f(x):\n    return g(x)\n"
    )
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(Path(kernel_cache.__file__).parents[2])]),
        "EVOEXP_CACHE": str(tmp_path / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",  # as long as before, in the same second: thought the same
    }
    command = [sys.executable, "-c", "from loose import outer; print(outer.f(1.0))"]
    for added in (1.0, 2.0):
        (folder / "inner.py").write_text(f"{head}@kernel\ndef g(x):\n    return x + {added}\n")
        found = subprocess.check_output(command, env=environment, text=True)
        assert float(found) == 1.0 + added
    assert not [*folder.rglob("*.nbi")]
