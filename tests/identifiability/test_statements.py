"""Counts of checks by what they rest on, and the two statements about a table that is another robot's."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import er3a.pipeline.messages.references
import er3a.pipeline.messages.validation  # noqa: F401
from er3a.diagnosis.diagnose import diagnosis_of
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.identifiability.reactions import bases_of
from er3a.identifiability.statements import inconsistent_with_own_text, not_the_robot_described
from er3a.numerics.peaks import peak
from er3a.pipeline.messages.say import say
from er3a.references.reference import Document, Documents


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "independent", "consistency", "claims"), [("er3_600", 11, 45, 0), ("er3a_c60", 24, 67, 2)]
)
def test_checks_by_what_they_rest_on(name, independent, consistency, claims):
    references = load_references(name)
    bases = bases_of(load_robot(name), references.checkable, references.documents)
    counts = Counter(basis.kind for basis in bases)
    assert (counts["independent"], counts["consistency"], counts["claim"]) == (independent, consistency, claims)
    for basis, reference in zip(bases, references.checkable):
        assert (basis.kind == "independent") == (bool(basis.independent_of) and reference.is_authoritative)
        assert set(basis.independent_of) <= set(basis.reacts_to)
        assert set(basis.same_publisher) <= set(basis.independent_of)


def test_the_drawing_and_the_step_model_are_two_documents_of_one_maker():
    references = load_references("er3_600")
    assert references.documents.independent("step_v1_2", "drawing_v1_1")
    assert references.documents.same_publisher("step_v1_2", "drawing_v1_1")
    documents = load_references("er3a_c60").documents
    assert documents.independent("urdf_2017", "vrml_2020")
    assert not documents.same_publisher("urdf_2017", "vrml_2020")


def test_documents_with_an_ancestor_in_common_are_not_independent():
    documents = Documents.of(
        [Document("a", "", "x"), Document("b", "", "y", ("a",)), Document("c", "", "z", ("a",)), Document("d", "", "w")]
    )
    assert not documents.independent("b", "c")
    assert not documents.independent("c", "a")
    assert documents.independent("b", "d")
    assert documents.independent("none", "none")


@pytest.mark.long
def test_the_article_is_another_robot_and_contradicts_its_own_text():
    robot = load_robot("er3a_c60_article")
    real = load_references("er3a_c60")
    other = not_the_robot_described(robot, real, diagnosis_of(robot, real).conclusion)
    assert other.left_mm > 300
    assert other.mismatch_mm > other.left_mm
    own = inconsistent_with_own_text(robot, load_references("er3a_c60_article"))
    assert (own.entry, own.given, own.needed) == ("offset2", 0.0, -90.0)
    assert "361.1" in say(other)
    assert "offset2" in say(own)
    corrected = robot.replace(offset=np.radians([0, -90, 0, 0, 0, 0]))
    assert inconsistent_with_own_text(corrected, load_references("er3a_c60_article")) is None
    assert not_the_robot_described(corrected, real, diagnosis_of(corrected, real).conclusion).left_mm > 300


@pytest.mark.parametrize("name", ["er3_600", "er3a_c60"])
def test_the_shipped_robots_are_themselves(name):
    robot, references = load_robot(name), load_references(name)
    assert not_the_robot_described(robot, references, diagnosis_of(robot, references).conclusion) is None
    assert inconsistent_with_own_text(robot, references) is None


def test_a_peak_inside_the_limits_is_found_from_each_of_their_corners():
    lower, upper, top = np.array([-1.0, -2.0, 0.0]), np.array([1.0, 0.5, 2.0]), np.array([0.3, -0.4, 1.1])
    for corner in np.stack(np.meshgrid(*zip(lower, upper)), axis=-1).reshape(-1, 3):
        at, values = peak(lambda q: 3.0 - ((q - top) ** 2).sum(axis=1), lower, upper, corner[None])
        np.testing.assert_allclose(at, [top], atol=1e-4)
        assert values == pytest.approx([3.0])
