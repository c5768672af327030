"""Motions as one self-contained page that plays offline in any browser."""

import base64
import html
import json
import math
import re
from collections.abc import Sequence
from importlib import resources
from typing import Any

import numpy as np

from evoexp.playback.colours import arm_colour
from evoexp.playback.recording import Recording, Shape
from evoexp.records import FloatArray

DIGITS = 6  # significant, of distances
MARGIN = {True: "kept", False: "not kept", None: "undecided"}
FILES = {"style": "motion_page.css", "geometry": "motion_geometry.js", "script": "motion_page.js"}


def page(recordings: Sequence[Recording]) -> bytes:
    """Return a page of HTML that plays one motion, or several side by side on one clock."""
    assets = resources.files("evoexp") / "assets"
    text = (assets / "motion_page.html").read_text(encoding="utf-8")
    data = json.dumps(
        [_motion(recording) for recording in recordings], separators=(",", ":"), allow_nan=False
    )
    values = {name: (assets / file).read_text(encoding="utf-8") for name, file in FILES.items()}
    values["title"] = html.escape(" | ".join(recording.heading.title for recording in recordings))
    values["motions"] = data.replace("<", "\\u003c")  # nothing in it can end the script element
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found[1]], text).encode()


def _motion(recording: Recording) -> dict[str, Any]:
    clearance, verdict = recording.clearance, recording.verdict
    pairs = list(dict.fromkeys(clearance.pairs))
    margin = {}  # the second badge, where a margin is required and no bodies touch
    if recording.margin > 0.0 and verdict.certified is not False:
        answer = verdict.certified_margin
        kind = {True: "kept", False: "broken", None: "unsure"}[answer]
        margin = {"margin_kind": kind, "margin_text": f"required margin {MARGIN[answer]}"}
    # joints of links without thickness: no body marks these joints
    shapes = [shape for shape in recording.shapes if shape.role == "arm" and shape.frame >= 0]
    lines = {shape.frame: arm_colour(shape.arm) for shape in shapes if shape.outline.is_line}
    return {
        "title": recording.heading.title,
        "status": {True: "certified", False: "refuted", None: "undecided"}[verdict.certified],
        "verdict": _verdict(recording),
        **margin,
        "facts": _facts(recording),
        "legend": _legend(recording),
        "unit": recording.length_unit,
        "planar": recording.view.planar,
        "center": recording.view.center.tolist(),
        "extent": recording.view.extent.tolist(),
        "radius": recording.view.radius,
        "moves": bool(np.ptp(recording.traces, axis=1).any()),
        "frames": len(recording.frames),
        "times": _packed(recording.times),
        "poses": _packed(recording.poses.world),
        "shapes": [_shape(shape) for shape in recording.shapes],
        "dots": [{"frame": frame, "colour": colour} for frame, colour in lines.items()],
        "ways": [
            {"colour": arm_colour(k), "points": _packed(way)}
            for k, way in enumerate(recording.traces)
        ],
        "targets": [
            {"name": target.name, "point": target.point.tolist()} for target in recording.targets
        ],
        "clearance": [_number(value) for value in clearance.least],
        "pairs": pairs,
        "nearest": [pairs.index(pair) for pair in clearance.pairs],
        "contacts": [list(contact) for contact in clearance.contacts],
        "margin": recording.margin,
        "least": _number(verdict.clearance),
        "least_at": verdict.clearance_at,
    }


def _shape(shape: Shape) -> dict[str, Any]:
    outline = shape.outline
    row: dict[str, Any] = {
        "name": shape.name,
        "kind": outline.kind,
        "size": list(outline.size),
        "frame": shape.frame,
        "pose": shape.pose.tolist(),
        "role": shape.role,
        "line": outline.is_line,
        "colour": arm_colour(max(shape.arm, 0)),
    }
    if outline.points is not None and outline.triangles is not None:
        row |= {"points": outline.points.tolist(), "triangles": outline.triangles.tolist()}
    return row


def _legend(recording: Recording) -> list[tuple[str, str]]:
    arms = sorted({shape.arm for shape in recording.shapes if shape.role == "arm"})
    names = [(f"arm {arm + 1}" if len(arms) > 1 else "robot", arm_colour(arm)) for arm in arms]
    roles = {shape.role for shape in recording.shapes}
    return names + [(role, role) for role in ("obstacle", "object") if role in roles]


def _verdict(recording: Recording) -> str:
    verdict, unit = recording.verdict, recording.length_unit
    if verdict.refuted_at is not None:
        more = len(recording.clearance.contacts) - 1
        again = f", and {more} time{'s' if more > 1 else ''} more" if more > 0 else ""
        return f"{verdict.refuted_pair} touch at instant {verdict.refuted_at:.4g}{again}"
    if verdict.clearance_at is None:
        return "nothing that could touch"
    return f"least clearance {verdict.clearance:.4g} {unit} at instant {verdict.clearance_at:.4g}"


def _facts(recording: Recording) -> list[tuple[str, str]]:
    verdict, heading, unit = recording.verdict, recording.heading, recording.length_unit
    rows = [("condition", recording.condition_id[:12])]
    if heading.replicate >= 0:
        rows.append(("replicate", str(heading.replicate)))
    if heading.improvements:
        generation, cost = heading.improvements[-1]
        rows.append(("best cost", f"{cost:.6g}, of generation {generation}"))
    rows.append(("least clearance", f"{_shown(verdict.clearance)} {unit}"))
    if verdict.clearance_pair:
        rows.append(("nearest", verdict.clearance_pair))
    if recording.margin > 0.0:
        margin = MARGIN[verdict.certified_margin]
        rows.append(("required", f"{recording.margin:g} {unit}: {margin}"))
    if verdict.allowed_contacts:
        depth = f"{_shown(verdict.penetration or 0.0)} {unit}"
        rows += [("may touch", verdict.allowed_contacts), ("deepest overlap of these", depth)]
    rows += [
        (f"contact {k + 1}", f"{contact.begin:.4g} to {contact.end:.4g}: {contact.pair}")
        for k, contact in enumerate(recording.clearance.contacts)
    ]
    length = float(np.sqrt((np.diff(recording.traces, axis=1) ** 2).sum(axis=-1)).sum())
    rows += [
        ("instants", str(recording.motion.num_segments + 1)),
        ("curve", "straight" if recording.motion.coefficients is None else "cubic"),
        ("tools’ ways", f"{length:.4g} {unit}"),
        ("bodies", f"{len(recording.shapes)}, as coal judges them"),
    ]
    return rows


def _packed(values: FloatArray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


def _number(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def _shown(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"
