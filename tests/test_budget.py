"""The budget of code counts what is executed, and every module belongs to a room."""

from __future__ import annotations

import pytest

from testing.budget import tokens, weights


def test_words_that_explain_are_free():
    bare = "def area(r: float) -> float:\n    return 3.0 * r * r\n"
    docstring, comment = '    """m², of a disc of radius r (m)."""\n', "    # a question that a reader would ask\n"
    explained = bare.replace("    return", f"{docstring}\n{comment}    return")
    assert explained.count("\n") == 5
    assert tokens(explained) == tokens(bare) == 16


def test_a_module_counts_in_the_room_that_names_it_most_closely_and_in_one_at_least(tmp_path):
    room = tmp_path / "er3a" / "robots"
    room.mkdir(parents=True)
    (room / "robot.py").write_text("a = 1\n")
    (room / "names.py").write_text("b = 2 + 3\n")
    found = weights({"all": ["robots/**/*.py"], "names": ["robots/names.py"]}, tmp_path)
    assert dict(found) == {"all": 3, "names": 5}
    with pytest.raises(ValueError, match=r"er3a/robots/names.py belongs to no room"):
        dict(weights({"robot": ["robots/robot.py"]}, tmp_path))
