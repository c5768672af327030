"""The facts about a condition on one screen, as aligned lines of plain text."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from evoexp.store.identity import TAKEN
from evoexp.validation import MOST_QUERIES, TARGET

INDENT = 13  # columns of the names on the left
SHOWN = ("python", "evoexp", "numpy", "numba", "pin", "coal")  # versions on the screen
MAX_LINES = 3  # of one entry; `show --all` prints everything
MAX_ENTRIES = 4  # of one kind: names, differences, failures


def screen(facts: Mapping[str, Any], width: int) -> Iterator[str]:
    """Yield the lines of a screen.

    Args:
        facts: As `facts` gives them.
        width: Columns of the terminal.
    """
    for name, text in _entries(facts):
        room = max(width - INDENT, 30)
        lines = [
            line
            for paragraph in text.splitlines() or [""]
            for line in textwrap.wrap(paragraph, room, break_on_hyphens=False) or [""]
        ]
        if len(lines) > MAX_LINES and name not in _WHOLE:
            lines = [*lines[: MAX_LINES - 1], f"{lines[MAX_LINES - 1][: room - 2]} …"]
        for k, line in enumerate(lines):
            yield f"{'' if k else name:{INDENT}}{line}".rstrip()


_WHOLE = ("condition", "origin", "environment", "result", "verdict", "note")  # never cut


def _entries(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield name and text of every entry."""
    yield "condition", facts["condition"]
    if facts["shipped_as"]:
        named = (f"{s['experiment']}, {s['label']}, {s['budget']}" for s in facts["shipped_as"])
        yield "shipped as", _first("; ".join, list(named))
    yield "components", ", ".join(map(_component, facts["components"]))
    yield "origin", "\n".join(_origin(facts["origin"], facts["result"] is not None))
    yield "environment", "\n".join(_environment(facts["environment"]))
    yield "result", "\n".join(_result(facts["result"], facts["origin"]))
    yield "verdict", "\n".join(_verdict(facts["verdict"]))
    for name, component in typed_parts(facts["settings"]).items():
        yield name, compact(component)
    for note in facts["notes"]:
        yield "note", note


def _first(join: Any, texts: Sequence[str]) -> str:
    """Join the first texts, and say how many more there are."""
    more = len(texts) - MAX_ENTRIES
    return str(join(texts[:MAX_ENTRIES])) + (f" and {more} more" if more > 0 else "")


def _component(component: Mapping[str, Any]) -> str:
    """Say a component's revision, and its package unless it is evoexp's own."""
    text = f"{component['component']} {component['revision']}"
    installed, package = component["installed_revision"], component["package"]
    if package is None:
        return f"{text} (not installed here)"
    if installed != component["revision"]:
        text += f" (here {installed})"
    return text if package.startswith("evoexp ") else f"{text} ({package})"


def _origin(origin: Mapping[str, Any], was_run: bool) -> Iterator[str]:
    """Yield the origin: names, options by the places they come from, the command, files."""
    names = [str(origin[name]) for name in ("experiment", "label") if origin.get(name)]
    if origin.get("budget"):
        names.append(f"budget {origin['budget']}")
    if archive := origin.get(TAKEN):
        yield f"out of {archive}, according to which this is:"
    if names:
        yield ", ".join(names)
    places: dict[str, list[str]] = {}
    for group, option in (origin.get("options") or {}).items():
        places.setdefault(option["origin"], []).append(f"{group}={option['name']}")
    for place, options in places.items():
        yield f"{place}: {' '.join(options)}"
    if was_run and origin.get("command") and not archive:  # somebody's command is none to be typed
        yield origin["command"]
    if origin.get("log"):
        yield f"{origin['log']}, replicate {origin['replicate']}"
    if code := origin.get("code"):
        yield f"commit {str(code.get('commit'))[:12]}" + (", changed" if code.get("dirty") else "")
    if origin.get("directory"):
        yield f"stored in {origin['directory']}"


def _environment(environment: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield versions, processor, and the differences from the environment here."""
    if environment is None:
        yield "–"
        return
    versions, platform = environment.get("versions") or {}, environment.get("platform") or {}
    yield ", ".join(f"{name} {versions[name]}" for name in SHOWN if versions.get(name))
    cpu = (environment.get("cpu") or {}).get("name")
    yield ", ".join(str(part) for part in (*platform.values(), cpu) if part)
    if differing := environment["differences"]:
        yield _first("\n".join, [f"not as here: {each}" for each in differing])


def _result(result: Mapping[str, Any] | None, origin: Mapping[str, Any]) -> Iterator[str]:
    """Yield replicates, costs and effort; or the command that runs the condition."""
    if result is None:
        yield f"not run here; run it: {origin['command']}"
        return
    if origin.get("log"):
        stopped = result["stop_reason"]
        solved = "solved" if result["solved"] else "not solved"
        reason = f" ({stopped})" if stopped != "generations" else ""
        yield f"{solved} after {result['generations']} generations{reason}"
        yield f"digest {result['digest']}"
    else:
        planned = f" of {result['planned']}" if result["planned"] is not None else ""
        failed = f", {result['failed']} failed" if result["failed"] else ""
        yield f"{result['done']}{planned} replicates done{failed}, {result['solved']} solved"
    if result["done"]:
        several = f", median {_number(result['median_cost'])}" if result["done"] > 1 else ""
        best = f"best cost {_number(result['best_cost'])} (replicate {result['best_replicate']})"
        yield best + several
        yield (
            f"each {_number(result['median_evaluations'])} evaluations, "
            f"{_number(result['median_collision_queries'])} collision queries, "
            f"{result['median_cpu_s']:.3g} s CPU"
        )
    for name, shape in (result.get("arrays") or {}).items():
        yield f"array {name}: {' × '.join(map(str, shape))}"
    if result["failures"]:
        reasons = [f"replicate {f['replicate']}: {f['reason']}" for f in result["failures"]]
        yield _first("\n".join, reasons)


def _verdict(verdict: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield the certifier's counts, the closest approach, and the first contacts."""
    if verdict is None:
        yield "–"
        return
    counts = [f"{verdict[name]} {name}" for name in ("certified", "refuted", "undecided")]
    if verdict["without_motion"]:
        counts.append(f"{verdict['without_motion']} without a motion")
    kept, certified = verdict["certified_margin"], verdict["certified"]
    yield ", ".join(counts) + f"; required margin kept by {kept} of the {certified} certified"
    if verdict["clearance"] is not None:
        place = f" ({verdict['clearance_pair']})" if verdict["clearance_pair"] else ""
        yield (
            f"least clearance {_number(verdict['clearance'])} {verdict['length_unit']}, "
            f"replicate {verdict['clearance_replicate']}{place}"
        )
    if verdict["allowed_contacts"]:
        deepest = f" ({verdict['penetration_pair']})" if verdict["penetration_pair"] else ""
        yield f"may touch: {', '.join(verdict['allowed_contacts'])}"
        yield (
            f"deepest overlap of these {_number(verdict['penetration'])} "
            f"{verdict['length_unit']}, replicate {verdict['penetration_replicate']}{deepest}"
        )
    if verdict["contacts"]:
        contacts = [
            f"replicate {c['replicate']} touches at {c['refuted_at']:.4g} ({c['refuted_pair']})"
            for c in verdict["contacts"]
        ]
        yield _first("\n".join, contacts)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.6g}"


def typed_parts(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of a canonical form by the names under which their settings are typed.

    A planner's components come out of it (`ga`, `collision`), and a planner out of its control.
    """
    parts: dict[str, Any] = {}
    for name, component in settings.items():
        if isinstance(component, Mapping) and isinstance(component.get("planner"), Mapping):
            around = {key: value for key, value in component.items() if key != "planner"}
            parts |= {"control": around} | typed_parts({"planner": component["planner"]})
        elif name == "planner":
            inner = {key: value for key, value in component.items() if _is_component(value)}
            own = {key: value for key, value in component.items() if key not in inner}
            parts |= {"planner": own} | inner
        elif name == MOST_QUERIES:
            parts["budget"] = {"collision_queries": component}
        else:
            parts[name] = component
    return parts


def _is_component(value: Any) -> bool:
    return isinstance(value, Mapping) and TARGET in value


def compact(value: Any) -> str:
    """Return plain configuration data in one line: `arms(arms=[planar_chain(…), …])`."""
    if isinstance(value, Mapping):
        inner = ", ".join(
            f"{key}={compact(item)}"
            for key, item in value.items()
            if key not in (TARGET, "revision")
        )
        return f"{value.get(TARGET, '')}({inner})"
    if isinstance(value, list):
        return f"[{', '.join(map(compact, value))}]"
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return str(value)
