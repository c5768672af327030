"""The rules by which claims are judged, as data.

The format stands at the head of `claim_kinds.yaml` beside this module.
"""

import collections
import functools
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import yaml

from evoexp.registry import Registration

OWN = "own"
KINDS: dict[str, dict[str, Any]] = yaml.safe_load(
    Path(__file__).with_name("claim_kinds.yaml").read_text(encoding="utf-8")
)


class Rule(NamedTuple):
    """A claim of a paper, and the rule by which it is judged."""

    name: str  # of the claim: `free_at_via_points`
    claim: str  # the claim in our words; {words} are filled in where it is judged
    source: str  # where the paper makes it
    kind: str  # one of `KINDS`
    reproduced: str  # when the claim is reproduced, in words
    contradicted: str  # when it is contradicted, in words; empty: wherever it is not reproduced
    limits: Mapping[str, float]  # numbers that the rule needs, by name
    experiments: tuple[str, ...]  # names of the experiments that judge it
    evidence: str = ""  # the numbers in a sentence, as `markdown.filled` takes it
    equal: str = ""  # when both sides are practically equal, in words

    def about(self, words: dict[str, object] | None = None) -> "Rule":
        """Return the rule with its words in braces filled in, where no judge gives any with "…"."""
        limits: dict[str, object] = {name: f"{limit:g}" for name, limit in self.limits.items()}
        unknown = collections.defaultdict[str, object](lambda: "…")
        known = collections.ChainMap(limits, unknown if words is None else words)
        fields = ("claim", "source", "reproduced", "contradicted", "equal")
        return self._replace(**{name: getattr(self, name).format_map(known) for name in fields})

    @property
    def text(self) -> str:
        """The rule in one sentence."""
        verdicts = {
            "reproduced": self.reproduced,
            "practically equal": self.equal,
            "contradicted": self.contradicted,
        }
        return "; ".join(f"{verdict} if {words}" for verdict, words in verdicts.items() if words)


Rules = Mapping[str, Rule]
NO_RULES: Rules = MappingProxyType({})


@functools.cache
def read_rules(path: Path) -> Rules:
    """Read the claims of a file.

    Raises:
        ValueError: If an entry lacks a key, has an unknown key, or another kind than `KINDS`.
    """
    rules = {}
    for name, entry in yaml.safe_load(path.read_text(encoding="utf-8")).items():
        missing = {"claim", "source", "kind", "experiments"} - entry.keys()
        unknown = entry.keys() - ({*Rule._fields} - {"name"})
        if missing or unknown or entry["kind"] not in KINDS:
            raise ValueError(
                f"{name}: must have claim, source, experiments, a kind out of {', '.join(KINDS)}; "
                f"missing: {sorted(missing)}, unknown: {sorted(unknown)}, kind: {entry.get('kind')}"
            )
        own = "reproduced" in entry
        if (entry["kind"] == OWN) != own or ("contradicted" in entry and not own):
            must = f"a rule of kind {OWN}, and no other, says when it is reproduced"
            raise ValueError(f"{name}: {must}")
        words = {"reproduced": "", "contradicted": "", **KINDS[entry["kind"]], **entry}
        least = {"equal": words.pop("least")} if "least" in words else {}
        words["source"], words["experiments"] = str(entry["source"]), tuple(entry["experiments"])
        words["limits"] = MappingProxyType(least | entry.get("limits", {}))
        rules[name] = Rule(name=name, **words)
    return MappingProxyType(rules)


def registered_rules(registration: Registration) -> Rules:
    """Return the rules that a package registers: as a file, or as the value of a module."""
    if registration.file is None:
        return cast(Rules, registration.load())
    with resources.as_file(registration.file) as path:
        return read_rules(path)
