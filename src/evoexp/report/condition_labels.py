"""Lists of conditions in few words, where labels are of a problem and a planner."""

from collections.abc import Sequence

BETWEEN = " · "  # the parts of a label


def have_two_parts(labels: Sequence[str]) -> bool:
    """Whether all labels are of a problem and a planner, and some share one."""
    parts = [label.split(BETWEEN) for label in labels]
    names = {part for own in parts for part in own}
    return all(len(own) == 2 for own in parts) and len(names) < 2 * len(parts)


def in_few_words(labels: Sequence[str], every: Sequence[str]) -> str:
    """Return a list of labels; a part of them stands for all labels that have it.

    Args:
        labels: Some of them.
        every: All labels of the page.

    Returns:
        "RRT" for "box · RRT, cage · RRT" if no other label ends so, "box" if these are all of its
        labels, "GA, RRT on box, cage" or "GA, RRT except on shelf" for parts of them; the labels
        themselves where they have not two parts.
    """
    if not have_two_parts(every):
        return ", ".join(labels)
    parts = [(label.split(BETWEEN)[0], label.split(BETWEEN)[1]) for label in every]
    chosen = {own for own, label in zip(parts, every, strict=True) if label in set(labels)}
    turned, chosen_turned = [own[::-1] for own in parts], {own[::-1] for own in chosen}
    found = _grouped(chosen, parts), _grouped(chosen_turned, turned)
    return min((", ".join(labels), *found), key=len)


def _grouped(chosen: set[tuple[str, str]], parts: Sequence[tuple[str, str]]) -> str:
    """Return pairs by their second parts, those together that are chosen of the same first ones."""
    groups: dict[tuple[tuple[str, ...], tuple[str, ...]], list[str]] = {}
    for second in dict.fromkeys(own[1] for own in parts):
        own = [pair for pair in parts if pair[1] == second]
        in_it = tuple(first for first, _ in own if (first, second) in chosen)
        out = tuple(first for first, _ in own if (first, second) not in chosen)
        if in_it:
            groups.setdefault((in_it, out), []).append(second)
    words = []
    for (in_it, out), names in groups.items():
        where = (
            f" except on {', '.join(out)}" if len(out) < len(in_it) else f" on {', '.join(in_it)}"
        )
        words.append(", ".join(names) + where * bool(out))
    return "; ".join(words)
