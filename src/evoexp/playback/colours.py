"""Colours of arms and obstacles; arms have the colours of the reports' figures."""

ARM_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")  # Okabe & Ito 2008
OBSTACLE, OBJECT, GOOD = "#8a8f94", "#b8860b", "#117733"


def arm_colour(arm: int) -> str:
    """Return the colour of an arm, counted from 0."""
    return ARM_COLOURS[arm % len(ARM_COLOURS)]
