"""Keep account of a build: what of its goal stands, what is left to do, and what is done about a surprise."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from agent.arm.clearing import Obstruction, obstructions
from agent.arm.eyes import STILL, Eyes, is_among
from agent.arm.grasps import Grasp
from agent.arm.monitor import NOTICEABLE, Change
from agent.arm.placement_order import bottom_at, precedence
from agent.arm.placement_rules import moving
from agent.arm.remainder import Remainder, Replanner
from agent.arm.standing_watch import StandingWatch, standing_at
from agent.arm.task_planner import Search
from structdiffusion.evaluation_protocol import MAX_TILT
from structdiffusion.geometry import tilt_between, transform_points
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TABLE

PUSHED = 0.02  # m from its goal: worth another move
LARGEST_CORRECTION = 0.02  # m by which an object follows the measured place and height of the one it will stand on
ON_TABLE = 0.02  # m: what goes no higher and on no other object goes on the table
MOST_PLACEMENTS = 3  # of one object: one that will not stand there is left as it is then
MOST_CORRECTIONS = 1  # placements after the first, of one object that stands, only farther off than it should
BLOCKED = "blocked"  # what a change is called where no way to a goal was found
MOST_FAILURES = 2  # rounds of picks of one object that all failed


class WorkLeft:
    """The goal of a build, and what of it stands.

    Args:
        eyes: what is known of where everything is.
        search: plans motions.
        arrangements: those that were proposed; what is laid out anew is added.
        rank: the index of the one that is built.
        replanner: proposes others where this one cannot be built; `None` if there is nobody to ask.

    Attributes:
        expected: now_from_initial (4, 4) of every object as planned so far.
        watch: what was placed.
    """

    def __init__(
        self, eyes: Eyes, search: Search, arrangements: list[Arrangement], rank: int, replanner: Replanner | None
    ) -> None:
        self._eyes, self._search, self._replanner = eyes, search, replanner
        self._arrangements = arrangements
        self._bottoms = [cloud.bottom for cloud in eyes.scene.objects]
        self.expected = list(eyes.motions[: eyes.count])
        self.watch = StandingWatch(eyes)
        self._placements, self._failures = Counter[int](), Counter[int]()
        self._aside = set[int]()
        self._left_out = set[int]()
        self._uprighted = set[int]()  # those that lay and were put upright
        self._why = dict[int, str]()  # object -> why it is moved again
        self._anew: Change | None = None
        # (P, 3) clouds of what was in the way and could not be taken away, and each with the grasps that failed.
        self._stuck = list[np.ndarray]()
        self._slipped = list[tuple[np.ndarray, Grasp]]()
        self._follow(arrangements[rank])

    def _follow(self, arrangement: Arrangement) -> None:
        """Build this arrangement from now on."""
        self.goal_from_initial = arrangement.goal_from_initial
        self._moves = set(moving(self.goal_from_initial))
        clouds = self._eyes.clouds[: self._eyes.count]
        *_, self.stands_on = precedence(clouds, list(self.goal_from_initial), self._bottoms)
        for index, containers in self._search.rules.into.items():
            self.stands_on[index] = next((key for key in containers if isinstance(key, int)), self.stands_on[index])

    # --- what stands -------------------------------------------------------------------------

    def goal(self, index: int) -> np.ndarray:
        """Return goal_from_initial (4, 4), shifted with the object that it will stand on: over where that is, by 2 cm
        at most, and at the height at which its top is, as the camera has measured them.
        """
        goal, eyes = self.goal_from_initial[index].copy(), self._eyes
        under = self.stands_on[index]
        if under is not None and under not in eyes.gone:
            now = eyes.measured[under] if under in self.watch else eyes.motions[under]
            offset = eyes.middle(under, now) - eyes.middle(under, self.goal_from_initial[under])
            distance = float(np.linalg.norm(offset[:2]))
            if distance < 2 * LARGEST_CORRECTION:
                goal[:2, 3] += offset[:2] * min(1.0, LARGEST_CORRECTION / max(distance, 1e-9))
                goal[2, 3] += float(np.clip(offset[2], -LARGEST_CORRECTION, LARGEST_CORRECTION))
        return goal

    def support(self, index: int) -> int | None:
        """Return what an object rests on at its goal: another one, `TABLE`, or `None` where the scene does not tell."""
        if self.stands_on[index] is not None or index in self._search.rules.into:
            return self.stands_on[index]
        bottom = bottom_at(self.goal_from_initial[index], self._eyes.clouds[index], self._bottoms[index])
        return TABLE if bottom < ON_TABLE else None

    def _carries(self, index: int) -> bool:
        """Return whether something was put on an object."""
        return any(other in self.watch and below == index for other, below in enumerate(self.stands_on))

    def _is_done(self, index: int, limit: float) -> bool:
        """Return whether nothing is left to do with an object itself: it stands at its goal, or it is given up.

        Args:
            limit: m from its goal, up to which it stands there.
        """
        if index in self._left_out or index in self._eyes.gone or self._failures[index] >= MOST_FAILURES:
            return True
        if index in self._moves and (index not in self.watch or index in self._aside):
            return False
        if self._placements[index] >= MOST_PLACEMENTS:
            return True
        way = standing_at(self._eyes, index, self.goal(index), self.support(index))
        settled = self._carries(index) or self._placements[index] > MOST_CORRECTIONS
        return way.stands and (settled or way.displacement <= limit)

    def _not_done(self) -> set[int]:
        """Return the objects that have to be moved: those that are not done, and what rests on them at the goal.

        What stands, only farther off than it should, is moved when all else is done, or before anything is put onto it;
        what is off by less, if a check of the goal fails by it.
        """
        every = range(self._eyes.count)
        bases = {below for i, below in enumerate(self.stands_on) if i in self._moves and i not in self.watch}
        found = {index for index in every if not self._is_done(index, PUSHED if index in bases else math.inf)}
        found = found or {index for index in every if not self._is_done(index, PUSHED)}
        if not found and self.missed():
            found = {index for index in every if not self._is_done(index, STILL)}
        while more := {i for i, below in enumerate(self.stands_on) if below in found and i in self.watch} - found:
            found |= more
        return found - self._left_out - self._eyes.gone

    def is_unfinished(self) -> bool:
        """Return whether any object has to be moved still."""
        return bool(self._not_done())

    def remainder(self) -> Remainder:
        """Return what is left of the build, as far as the camera knows."""
        not_done = self._not_done()
        left = self._left()
        standing = frozenset(i for i in left if i not in not_done and (i in self.watch or i not in self._moves))
        return self._remainder(left, self._eyes.motions, standing)

    def missed(self) -> Sequence[str]:
        """Say which checks of the goal fail where things were measured last, though all that was to move stands."""
        left = self._left()
        stands = all(i in self.watch and not self.watch.trouble(i) for i in self._moves.intersection(left))
        if self._replanner is None or not stands:
            return ()
        return self._replanner.missed(self._remainder(left, self._eyes.measured, frozenset(left)))

    def _left(self) -> tuple[int, ...]:
        """Return the objects that are on the table and not left out."""
        return tuple(i for i in range(self._eyes.count) if i not in self._eyes.gone | self._left_out)

    def _remainder(self, left: tuple[int, ...], motions: Sequence[np.ndarray], standing: frozenset[int]) -> Remainder:
        eyes, count = self._eyes, self._eyes.count
        seen = eyes.scene_now()
        in_the_way = (seen.objects[i] for i in range(count) if i not in left and i not in eyes.gone)
        others = (*seen.distractors, *in_the_way)
        return Remainder(
            eyes.scene, others, left, np.array(motions[:count]), np.asarray(self.goal_from_initial), standing
        )

    def goals_left(self) -> list[np.ndarray]:
        """Return the clouds (P, 3) of the objects that have to be moved still, at their goals."""
        return [transform_points(self.goal(index), self._eyes.clouds[index]) for index in sorted(self._not_done())]

    def obstructions(self) -> list[Obstruction]:
        """Return what is in the way of these, and has no place in the structure itself; without what could not be taken
        away.
        """
        eyes = self._eyes
        brought = {k for k in range(eyes.count, len(eyes.names)) if self._was_moved(k)}
        found = obstructions(eyes, sorted(self._left_out | brought - eyes.gone), self.goals_left())
        return [one for one in found if not is_among(one.cloud, self._stuck)]

    def _was_moved(self, k: int) -> bool:
        """Return whether a distractor is not where it was, and nothing of the goal depends on it."""
        eyes, replanner = self._eyes, self._replanner
        moved = float(np.linalg.norm(eyes.middle(k, eyes.motions[k]) - eyes.middle(k, np.eye(4)))) > NOTICEABLE
        return moved and not (replanner is not None and replanner.concerns(eyes.names[k]))

    # --- what happens to it ------------------------------------------------------------------

    def count_placement(self, index: int, aside: bool, uprighted: bool) -> None:
        """Take it that an object was placed, or set aside for now; `uprighted`: it lay before."""
        self._why.pop(index, None)
        self._uprighted |= {index} if uprighted else set()
        if aside:
            self._aside.add(index)
            self._why[index] = "had been set aside"
        else:
            self._aside.discard(index)
            self._placements[index] += 1

    def count_slip(self, thing: Obstruction, grasp: Grasp) -> None:
        """Take it that something in the way could not be taken by a grasp."""
        self._slipped.append((thing.cloud, grasp))

    def slipped_from(self, thing: Obstruction) -> list[Grasp]:
        """Return the grasps by which something in the way could not be taken."""
        return [grasp for cloud, grasp in self._slipped if is_among(thing.cloud, [cloud])]

    def reason_to_move(self, index: int) -> str:
        """Say why an object is moved although it had been moved before, in words that follow its name, or nothing."""
        return self._why.get(index, "")

    def give_up(self, index: int, blocked: str) -> Change | None:
        """Take it that an object could not be moved; the second time it is left where it is.

        Args:
            index: the object.
            blocked: why no way was found to bring it to its goal; empty if that is not why.

        Returns:
            The change that is answered by `answer_failure`, if there is one: it lies, or its goal cannot be reached as
            things stand now, for the first time.
        """
        self._failures[index] += 1
        name = self._eyes.names[index]
        if tilt_between(self._eyes.motions[index], np.eye(4)) > MAX_TILT:
            return Change(index, name, "fallen", "lies and cannot be put upright")
        if blocked and self._failures[index] < MOST_FAILURES and self._replanner is not None:
            return Change(index, name, BLOCKED, f"cannot be brought to its goal: {blocked}")
        return None

    def answer_failure(self, change: Change) -> str:
        """Return what is done about an object that could not be moved, as `Noticed` has it."""
        if change.what != BLOCKED:
            return self.leave_out(change)
        self._anew = change
        return "lay out anew"

    def answer(self, change: Change) -> str:
        """Return what is done about a change, as `Noticed` has it."""
        index, replanner = change.index, self._replanner
        if index is None or index >= self._eyes.count:
            if index is not None and replanner is not None and replanner.concerns(change.name):
                self._anew = change
                return "lay out anew"
            return "set aside" if self.obstructions() else "go on"
        if index in self._left_out:
            if change.what == "appeared" and index in self._moves:
                self._left_out.discard(index)
            return "go on"
        # What lies again after it was put upright is not tried once more: it may fell others.
        if change.what == "gone" or (change.what == "fallen" and index in self._uprighted):
            return self.leave_out(change) if index in self._moves else "go on"
        if index in self._moves and index not in self.watch:
            return "go on"
        if self._is_done(index, math.inf):
            return "go on"
        return "take down" if self._carries(index) else "place again"

    def leave_out(self, change: Change) -> str:
        """Leave an object out from now on, because of a change; return what is done about that."""
        assert change.index is not None
        self._left_out.add(change.index)
        if self._replanner is None:
            return "leave out"
        self._anew = change
        return "lay out anew"
