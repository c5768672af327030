from evoexp.collision.certifier.certificate import Certificate, combined

FREE = Certificate(True, True, 0.3, 2.0, "a – b", None, "", 10)


def test_the_first_contact_counts() -> None:
    late = Certificate(False, False, 0.0, 7.0, "c – d", 7.0, "c – d", 5)
    early = late._replace(refuted_at=3.0, clearance_at=3.0, refuted_pair="e – f")
    found = combined([FREE, late, early])
    assert found == early._replace(certificate_queries=20)


def test_without_contact_the_least_clearance_counts() -> None:
    close = FREE._replace(clearance=0.1, clearance_at=5.0, certified_margin=False)
    found = combined([FREE, close])
    assert (found.certified, found.certified_margin, found.clearance, found.clearance_at) == (
        True,
        False,
        0.1,
        5.0,
    )


def test_one_undecided_part_leaves_the_whole_undecided() -> None:
    found = combined([FREE, FREE._replace(certified=None, certified_margin=None)])
    assert found.certified is None
    assert found.certified_margin is None
