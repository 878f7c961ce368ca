"""What Snakemake's report says of the study and of its pages, in the language of the pages."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_, tr

# Words of the lists in which a reader of the report chooses pages; the workflow's rules use them.
PAGE, INDEX, ALL_ROBOTS = N_("page"), N_("index"), N_("All robots")
TEACH_PANEL, COMPARISON = N_("teach panel"), N_("two robots side by side")


def of_study() -> str:
    """The report's first page."""
    told = (
        tr("Evidence on kinematic models of robots: can each table be trusted, and what can the arm do?"),
        tr(
            "Start with the index: verdicts and key figures of every robot and stage. Each robot has a page for"
            " each stage and a teach panel. Pages are complete and work offline; links between pages do not "
            "work inside this report, so choose pages from the lists here."
        ),
        tr(
            "A fail is a result, not a broken run: evidence contradicts the table. The foot of each page lists "
            "its inputs and the command that reproduces it."
        ),
    )
    return "\n\n".join(told)


def of_stage(robot: str, question: str) -> str:
    """A stage's page: what it answers."""
    return tr(
        "{robot}: {question} The verdict comes first, then the figures behind it; the foot of the page names their "
        "sources.",
        robot=robot,
        question=tr(question),
    )


def of_teach_panel(robot: str) -> str:
    """The teach panel."""
    return tr(
        "Move {robot} by hand: joints, typed poses, jogging, way points, distance from singularities, and all "
        "IK solutions of the pose.",
        robot=robot,
    )


def of_index() -> str:
    """The index."""
    return tr("What to do with each robot's model, and the verdicts and key figures behind that.")


def of_comparison() -> str:
    """The comparison of two robots."""
    return tr("Two robots side by side: parameters, key figures, and the borders of what they reach in one drawing.")
