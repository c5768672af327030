"""The environment of a computation: versions, processor, code; never part of an identity."""

import os
import platform
import subprocess
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import metadata
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

_DISTRIBUTIONS = (
    *("evoexp", "numpy", "numba", "llvmlite", "scipy", "pin", "libpinocchio", "coal", "libcoal"),
    *("hydra-core", "omegaconf", "pydantic", "joblib", "mcap", "zstandard", "orjson", "xxhash"),
    *("pandas", "pyarrow"),
)

# Processor flags that decide which instructions a compiler may choose; others change no number.
_VECTOR_PREFIXES = ("sse", "ssse", "avx", "fma", "f16c", "bmi", "amx", "asimd", "sve", "neon", "fp")


class Difference(NamedTuple):
    """One entry in which two environments differ; None where one of them lacks it."""

    name: str
    was: Any
    now: Any

    def __str__(self) -> str:
        """Return the difference in one line."""
        return f"{self.name}: was {self.was}, now {self.now}"


def manifest(condition_id: str, components: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the manifest of a run: its full hash, the environment, the state of the code."""
    return {"condition": condition_id, **environment(components), "git": git_state()}


def environment(components: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return versions, platform and processor, and the packages of components not of evoexp."""
    return {**_environment(), "components": dict(components)} if components else _environment()


@cache
def _environment() -> dict[str, Any]:
    """Return the part of the environment that is the same for all conditions, found in 15 ms."""
    versions: dict[str, str | None] = {"python": platform.python_version()}
    for name in _DISTRIBUTIONS:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = None
    system = {
        "system": platform.system(),
        "machine": platform.machine(),
        "libc": " ".join(platform.libc_ver()).strip() or None,
    }
    # name and vector features of the processor, from /proc/cpuinfo where there is one
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").split("\n\n")[0]
    except OSError:
        text = ""
    pairs = (line.partition(":") for line in text.splitlines())
    entries = {name.strip().lower(): value.strip() for name, _, value in pairs}
    flags = (entries.get("flags") or entries.get("features") or "").split()
    features = [flag for flag in flags if flag.startswith(_VECTOR_PREFIXES) and flag[:3] != "fpu"]
    cpu = {"name": entries.get("model name") or platform.processor() or None}
    return {"versions": versions, "platform": system, "cpu": cpu | {"features": sorted(features)}}


@cache
def git_state() -> dict[str, Any] | None:
    """Return commit and dirty flag of the checkout that evoexp is imported from, or None."""
    root = Path(__file__).resolve().parents[3]  # <root>/src/evoexp/store/manifest.py
    if not (root / ".git").exists() or not (root / "pyproject.toml").exists():
        return None
    commit = _git(root, "rev-parse", "--verify", "--quiet", "HEAD")
    status = _git(root, "status", "--porcelain", "--", "src", "conf", "pyproject.toml")
    return {"commit": commit or None, "dirty": None if status is None else bool(status)}


def differences(was: Mapping[str, Any], now: Mapping[str, Any]) -> list[Difference]:
    """Return the entries in which two manifests or environments differ, in alphabetical order.

    Only sections that both have are compared; of two lists, entries that the other lacks are named.
    """
    shared = was.keys() & now.keys() - {"condition"}
    before, after = ({name: each[name] for name in shared} for each in (was, now))
    entries = []
    for name, old, new in sorted(changed(before, after), key=itemgetter(0)):
        if isinstance(old, list) and isinstance(new, list):
            old, new = [x for x in old if x not in new], [x for x in new if x not in old]
        if old != new:
            entries.append(Difference(name, old, new))
    return entries


def changed(one: Any, two: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield (dotted name, value, other value) where plain data differ; None: not there."""
    before, after = dict(leaves(one)), dict(leaves(two))
    for name in dict.fromkeys([*before, *after]):
        if before.get(name) != after.get(name):
            yield name, before.get(name), after.get(name)


def leaves(tree: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of plain data by dotted names; lists without mappings are one value."""
    items = list(tree.items()) if isinstance(tree, Mapping) else []
    if isinstance(tree, list) and any(isinstance(item, Mapping) for item in tree):
        items = list(enumerate(tree))
    for key, value in items:
        yield from leaves(value, f"{name}.{key}" if name else str(key))
    if not items:
        yield name, tree


def _git(root: Path, *arguments: str) -> str | None:
    command = ["git", "--no-optional-locks", "-C", str(root), *arguments]
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=10, check=False, env=clean
        )
    except (OSError, subprocess.SubprocessError, ValueError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
