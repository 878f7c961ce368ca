"""One colour for each of the four arm shapes (shoulder, elbow), on the page and in the recording alike.

Safe for colour-blind readers and different from the joints' colours: P. Tol, "Colour schemes", 2021, scheme *bright*.
"""

SHAPE_COLOURS = ("#4477aa", "#ccbb44", "#228833", "#66ccee")


def shape_of(branch: int, label: str) -> int:
    """Number of the arm shape: two wrist branches of the closed form share one; found arms have one each."""
    return branch if label == "found_arm" else branch // 2


def colour_of(shape: int) -> str:
    """The shape's colour; beyond four the colours repeat."""
    return SHAPE_COLOURS[shape % len(SHAPE_COLOURS)]
