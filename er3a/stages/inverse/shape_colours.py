"""One colour for each of the four arm shapes (shoulder, elbow), on the page and in the recording alike.

Safe for colour-blind readers and apart from the joints' colours: P. Tol, "Colour schemes", 2021, scheme *bright*.
"""

SHAPE_COLOURS = ("#4477aa", "#ccbb44", "#228833", "#66ccee")
