"""One colour for each of the four arm shapes (shoulder, elbow), on the page and in the recording alike.

Safe for colour-blind readers and apart from the joints' colours: P. Tol, "Colour schemes", 2021, scheme *bright*.
"""

SHAPE_COLOURS = ("#4477aa", "#ccbb44", "#228833", "#66ccee")


def shape_of(branch: int, label: str) -> int:
    """Number of the arm shape: two wrist branches of the closed form share one; found arms have one each."""
    return int(branch) // 2 if "," in label else int(branch)


def colour_of(shape: int) -> str:
    """The shape's colour; beyond four the colours repeat."""
    return SHAPE_COLOURS[shape % len(SHAPE_COLOURS)]
