"""The rules by which claims are judged, as data.

A paper keeps its claims in a file `claims.yaml` beside its pages, which its entry point
`evoexp.claims` names (`my_paper = "my_paper:claims.yaml"`), one entry per claim:

    free_at_via_points:                     # its name
      claim: "{who}The motion is free of collision at the via-points, in every run"
      source: "section 3.5, Fig. {figure}"  # where the paper makes it
      kind: every                           # one of `KINDS`, which says when it is reproduced
      experiments: [rana, rana_planar]      # those that judge it
      evidence: "{free} finished runs"      # the numbers; {x!n}: as text, see `markdown.filled`
    reasonable:
      claim: "100 individuals are reasonable: {metric}"
      source: "section 5"
      kind: own                             # then it says itself when it is
      reproduced: "the effort of 100 is at most {most} times that of the best size, on every task"
      contradicted: "it is more on a task"  # optional; without it: wherever it is not reproduced
      limits: {most: 2.0}                   # numbers that the rule needs, read by the code
      experiments: [corsepius_population]

Words in braces are limits, or are given where the claim is judged:

    RULES = read_rules(Path(__file__).with_name("claims.yaml"))
    judge = judging.judge(results, settings, RULES)
    hearing = judge.on("free_at_via_points", who="", figure="4")
    hearing.every({"free": share}, holds, done, planned)
    most = RULES["reasonable"].limits["most"]
    judge.on("reasonable", metric="cycles").own(evidence, n=50, holds=factor <= most)

The evidence holds the numbers alone; the rule stands in a column of its own. Evidence that depends
on more than numbers is given as a text instead.
"""

import collections
import functools
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, cast

import yaml

from evoexp.registry import Registration

OWN = "own"
# kind → (reproduced, contradicted)
KINDS: dict[str, tuple[str, str]] = yaml.safe_load(
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

    def about(self, **words: object) -> "Rule":
        """Return the rule with its words in braces filled in; limits are known already.

        Raises:
            KeyError: If a word is missing.
        """
        return self._filled(words)

    def unjudged(self) -> "Rule":
        """Return the rule with its limits filled in, and "…" for words that a judge would give."""
        return self._filled(collections.defaultdict(lambda: "…"))

    def _filled(self, words: dict[str, object]) -> "Rule":
        for name, limit in self.limits.items():
            words.setdefault(name, f"{limit:g}")
        texts = (self.claim, self.source, self.reproduced, self.contradicted)
        claim, source, reproduced, contradicted = (text.format_map(words) for text in texts)
        return self._replace(
            claim=claim, source=source, reproduced=reproduced, contradicted=contradicted
        )

    @property
    def text(self) -> str:
        """The rule in one sentence."""
        against = f"; contradicted if {self.contradicted}" if self.contradicted else ""
        return f"reproduced if {self.reproduced}{against}"


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
        words = dict(zip(("reproduced", "contradicted"), KINDS[entry["kind"]], strict=True))
        data = {
            "source": str(entry["source"]),
            "limits": MappingProxyType(dict(entry.get("limits", {}))),
            "experiments": tuple(entry["experiments"]),
        }
        rules[name] = Rule(name=name, **{**words, **entry, **data})
    return MappingProxyType(rules)


def registered_rules(registration: Registration) -> Rules:
    """Return the rules that a package registers: as a file, or as the value of a module."""
    if registration.file is None:
        return cast(Rules, registration.load())
    with resources.as_file(registration.file) as path:
        return read_rules(path)
