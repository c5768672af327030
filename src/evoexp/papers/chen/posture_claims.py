"""The numbers that Chen & Zalzala 1995 print of their docking postures, judged by exact optima."""

from collections.abc import Iterator

import numpy as np

from evoexp.papers.chen.cases import Case
from evoexp.papers.chen.rules import RULES
from evoexp.records import FloatArray
from evoexp.report.kit import Claim, Judge, markdown


def judge_printed(judge: Judge, case: Case) -> Iterator[Claim]:
    """Judge the number, the angles, the torques and their ratio, as far as they are printed."""
    printed = case.printed
    if not np.isnan(printed.value):
        yield judge_value(judge, case)
    if printed.angles is not None:
        yield _angles(judge, case, printed.angles)
    if printed.torques is not None:
        torques = np.array(printed.torques)
        yield _torques(judge, case, torques)
        if printed.angles is not None:
            yield _torques_at_angles(judge, case, torques, printed.angles)
        if not np.isnan(printed.ratio):
            yield _ratio(judge, case, torques)


def judge_value(judge: Judge, case: Case) -> Claim:
    """Judge the printed number by that of the exact optimum."""
    printed, exact = case.printed, case.measured(case.optimal_angles)
    best, name = exact[printed.term], printed.term.replace("_", " ")
    told = f"at the exact optimum {markdown.number(best)}"
    if case.conditions[0].planner.objective.avoidances:
        told += (
            f" (E = {markdown.number(case.least)}, of which the obstacle "
            f"{markdown.number(exact['obstacle'])})"
        )
    agrees: bool | None = abs(best - printed.value) <= RULES["printed_value"].limits["rounded"]
    if case.name == "obstacle and platform":
        told += "; where the obstacle stands is not printed, (5.2, 0) is assumed"
        agrees = agrees or None
    words = {"case": case.name, "term": name, "value": f"{printed.value:g}"}
    return judge.on("printed_value", figure=printed.figure, **words).own(told, 1, agrees)


def _angles(judge: Judge, case: Case, angles: tuple[float, float]) -> Claim:
    """Judge that the printed angles are near the optimum."""
    cost = case.measured(angles)["cost"]
    gap = 100.0 * float(case.gaps(np.array([cost]))[0])
    words = {"case": case.name, "angles": _degrees(angles), "figure": case.printed.figure}
    return judge.on("printed_angles", **words).own(
        f"E = {cost:.6g} there, {case.least:.6g} at the optimum: {gap:.2g} % above it",
        1,
        gap <= RULES["printed_angles"].limits["near_percent"],
    )


def _torques(judge: Judge, case: Case, torques: FloatArray) -> Claim:
    """Judge the printed torques by those of the exact optimum, of its mirror images the nearest."""
    exact, limits = _nearest(case, torques), RULES["printed_torques"].limits
    by_norm = case.conditions[0].planner.objective.torque_norm_weight > 0.0
    cost = float((torques**2).sum() if by_norm else np.abs(torques).max())
    gap, off = 100.0 * (cost / case.least - 1.0), float(np.abs(exact - torques).max())
    words = {"case": case.name, "torques": triple(torques, 2), "figure": case.printed.figure}
    return judge.on("printed_torques", **words).own(
        f"{triple(exact, 4)} at the exact optimum, at most {off:.2g} off; E = {cost:.4g} of the "
        f"printed torques, {gap:.2g} % above the optimum's {case.least:.4g}",
        1,
        gap <= limits["near_percent"] and off <= limits["rounded"],
    )


def _torques_at_angles(
    judge: Judge, case: Case, torques: FloatArray, angles: tuple[float, float]
) -> Claim:
    """Judge the printed torques by those of our model at the printed angles."""
    own = case.torques(angles)
    off = float(np.abs(own - torques).max())
    words = {"torques": triple(torques, 2), "angles": _degrees(angles)}
    return judge.on("torques_at_angles", case=case.name, figure=case.printed.figure, **words).own(
        f"{triple(own, 4)} in our model, at most {off:.2g} off",
        1,
        off <= RULES["torques_at_angles"].limits["rounded"],
    )


def _ratio(judge: Judge, case: Case, torques: FloatArray) -> Claim:
    """Judge the printed ratio of torques by the printed torques, and by the exact optimum."""
    printed, limits = case.printed, RULES["torque_ratio"].limits
    sizes, rounded = np.abs(torques), limits["rounded"]
    least = (sizes.max() - rounded) / (sizes.min() + rounded)
    greatest = (sizes.max() + rounded) / (sizes.min() - rounded)
    exact = np.abs(_nearest(case, torques))
    own = float(exact.max() / exact.min())
    off = 100.0 * (own / printed.ratio - 1.0)
    words = {"case": case.name, "ratio": f"{printed.ratio:g}", "figure": printed.figure}
    return judge.on("torque_ratio", **words).own(
        f"{sizes.max() / sizes.min():.3g} of the printed torques as they stand, {least:.3g} to "
        f"{greatest:.3g} before they were rounded; {own:.4g} at the exact optimum ({off:+.1f} %)",
        1,
        least <= printed.ratio <= greatest and abs(off) <= limits["near_percent"],
    )


def _nearest(case: Case, torques: FloatArray) -> FloatArray:
    """Return the torques of the optimum, of its mirror images those nearest to some others."""
    found = [case.torques(angles) for angles in case.mirrored()]
    return min(found, key=lambda own: float(np.abs(own - torques).max()))


def triple(torques: FloatArray, digits: int) -> str:
    """Return torques in words: (−0.61, 1.13, −0.30)."""
    told = ", ".join(f"{torque:.{digits}f}" for torque in torques)
    return f"({told})".replace("-", "−")


def _degrees(angles: tuple[float, float]) -> str:
    return f"({angles[0]:g}, {angles[1]:g})°".replace("-", "−")
