"""Lists of conditions in few words."""

import itertools

from evoexp.report.pages.index import have_two_parts, in_few_words

EVERY = [f"{problem} · {planner}" for problem in "abcd" for planner in ("GA", "RRT", "ES")]


def test_a_part_stands_for_all_labels_that_have_it() -> None:
    assert in_few_words([f"{p} · RRT" for p in "abcd"], EVERY) == "RRT"
    assert in_few_words(["b · GA", "b · RRT", "b · ES"], EVERY) == "b"
    assert in_few_words(["a · RRT", "b · RRT"], EVERY) == "RRT on a, b"
    assert in_few_words(["a · RRT"], EVERY) == "a · RRT"
    assert (
        in_few_words([f"{p} · {x}" for p in "abc" for x in ("GA", "ES")], EVERY)
        == "GA, ES except on d"
    )


def meant(words: str) -> set[str]:
    """Return the labels that a list stands for."""
    if all(" · " in word for word in words.split(", ")):
        return set(words.split(", "))
    found = set()
    for group in words.split("; "):
        names, _, but = group.partition(" except on ")
        names, _, only = names.partition(" on ")
        for one in names.split(", "):
            own = {label for label in EVERY if one in label.split(" · ")}
            places = {label: set(label.split(" · ")) - {one} for label in own}
            found |= {
                label
                for label, (place,) in places.items()
                if place not in but.split(", ") and (not only or place in only.split(", "))
            }
    return found


def test_every_list_means_what_it_lists() -> None:
    for count in range(1, len(EVERY) + 1):
        for labels in itertools.islice(itertools.combinations(EVERY, count), 0, None, 5):
            words = in_few_words(labels, EVERY)
            assert meant(words) == set(labels), words
            assert len(words) <= len(", ".join(labels))


def test_other_labels_stay_as_they_are() -> None:
    every = ["I", "II · x", "III"]
    assert not have_two_parts(every)
    assert not have_two_parts(["a · x", "b · y"])
    assert in_few_words(every[:2], every) == "I, II · x"
