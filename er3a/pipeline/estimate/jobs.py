"""The jobs of a study, as the workflow has them, and how long some cores take for them."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study


@dataclass(frozen=True)
class Job:
    """One call of the command line.

    Attributes
    ----------
    verb : sample, compute, record, report, teach or index
    stage, robot : empty where the verb has none
    samples : how many are drawn
    needs : numbers of the jobs that must be done before
    """

    verb: str
    stage: str
    robot: str
    samples: int = 0
    needs: tuple[int, ...] = ()

    @property
    def key(self) -> tuple[str, str, str]:
        """Verb, stage and robot."""
        return self.verb, self.stage, self.robot


def jobs_of(study: Study) -> list[Job]:
    """All jobs of a study, each behind those that it needs."""
    jobs: list[Job] = []
    pages: list[int] = []

    def add(*job, **named) -> int:
        jobs.append(Job(*job, **named))
        return len(jobs) - 1

    for robot in study.names:
        computed: dict[str, int] = {}
        for stage in study.stages(robot):
            parts: tuple[int, ...] = ()
            if STAGES[stage].sampled:
                count, total = study.section(WorkspaceSettings).parts, study.section(WorkspaceSettings).samples
                parts = tuple(
                    add("sample", stage, robot, total * (n + 1) // count - total * n // count) for n in range(count)
                )
            done = computed[stage] = add("compute", stage, robot, needs=parts)
            shown, views = done, STAGES[stage].views
            if "record" in views:
                shown = add("record", stage, robot, needs=(done,))
            if "report" in views:
                pages.append(add("report", stage, robot, needs=(shown,)))
        if "teach" in study.pages(robot):
            pages.append(add("teach", "", robot, needs=(computed["validation"],)))
    add("index", "", "", needs=tuple(pages))
    return jobs


def wall_time(jobs: Sequence[Job], seconds: Sequence[float], cores: int) -> float:
    """Time (s) until the last job is done, each taking its seconds, if each core takes the next whose needs are met."""
    waiting = [len(job.needs) for job in jobs]
    freed: list[list[int]] = [[] for _ in jobs]
    for number, job in enumerate(jobs):
        for need in job.needs:
            freed[need].append(number)
    ready = [number for number, count in enumerate(waiting) if count == 0]
    heapq.heapify(ready)
    running: list[tuple[float, int]] = []
    now = 0.0
    while ready or running:
        while ready and len(running) < cores:
            number = heapq.heappop(ready)
            heapq.heappush(running, (now + seconds[number], number))
        now, done = heapq.heappop(running)
        for number in freed[done]:
            waiting[number] -= 1
            if waiting[number] == 0:
                heapq.heappush(ready, number)
    return now
