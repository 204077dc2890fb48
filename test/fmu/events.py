"""Events in model exchange (fmu.py): a small importer that locates them, and fmusim, against closed forms and runs."""
# SPDX-License-Identifier: Apache-2.0
import ctypes
import math
import os

from archive import COMMAND, SCENES, Fmu, rows, run
from claims import claim, note, skip
from foreign import INTERVALS, play_foreign
from instance import REAL, SIZE, Instance

# A ball that bounces; a damper that becomes stronger at 0.7 s; the end of the run where the hand has turned by 1.15 rad.
SCENE = """kinetree: 1
parameters: {bounce: 0.8}
gravity: [0, 0, -10]
bodies:
  - {name: ball, mass: 1, joint: {name: drop, type: prismatic, axis: z, position: 1.25}}
  - {name: hand, mass: 2, joint: {name: turn, type: revolute, axis: x, velocity: 1}, inertia: [2, 2, 2], com: [0, 0, 0]}
effects:
  - {name: damper, type: joint_damper, joint: turn, damping: =bounce}
events:
  - {name: floor, when: position.drop, direction: falling, then: {set: {velocity.drop: "-0.8*velocity.drop"}}, limit: 2}
  - {name: later, when: t - 0.7, then: {set: {bounce: 2}}}
  - {name: through, when: position.drop < -0.02, then: {set: {velocity.drop: "2"}}}
simulate: {integrator: rk4, step: 0.001, duration: 2.5, until: position.turn > 1.15}
output: {record: [position, velocity, state]}
"""
EXACT, WIDTH = 1e-9, 1e-14  # of times and positions; s, of the enclosure of an event
FOREIGN = 2e-7  # relative, after events that CVODE locates at a tolerance of 1e-10; measured: 3.4e-8


class Importer:
    """The classical method with steps of 5 ms. Changes of sign are enclosed by bisection of the step."""

    def __init__(self, fmu):
        self.fmu, self.instance = fmu, Instance(fmu, True)
        self.count = SIZE()
        self.instance.call("GetNumberOfEventIndicators", ctypes.byref(self.count))
        self.time, self.events = 0.0, []
        self.instance.update_discrete()
        self.instance.call("EnterContinuousTimeMode")
        self.states = self.instance.states()

    def values(self, time, states):
        values = (REAL * self.count.value)()
        self.instance.rates(time, states)
        self.instance.call("GetEventIndicators", values, self.count)
        return [value > 0 for value in values]

    def advance(self, size):
        def rates(share, slope):
            return self.instance.rates(self.time + share, [y + share * s for y, s in zip(self.states, slope)])
        a = rates(0.0, [0.0] * len(self.states))
        b = rates(size / 2, a)
        c = rates(size / 2, b)
        d = rates(size, c)
        return [y + size / 6 * (k + 2 * l + 2 * m + n) for y, k, l, m, n in zip(self.states, a, b, c, d)]

    def step(self, size):
        """Takes a step, or a part of it up to an event; returns whether the run is over."""
        before, states = self.values(self.time, self.states), self.advance(size)
        changes = self.values(self.time + size, states) != before
        low = 0.0
        while changes and size - low > WIDTH:
            middle = 0.5 * (low + size)
            trial = self.advance(middle)
            if self.values(self.time + middle, trial) != before:
                size, states = middle, trial
            else:
                low = middle
        self.time, self.states = self.time + size, states
        self.values(self.time, states)
        if not changes:
            return False
        self.events.append(self.time)
        self.instance.call("EnterEventMode")
        flags, _ = self.instance.update_discrete()
        if flags[3]:
            self.states = self.instance.states()
        self.instance.call("EnterContinuousTimeMode")
        return flags[1]

    def play(self, end):
        while self.time < end - 1e-12:
            if self.step(min(0.005, end - self.time)):
                return True
        return False


def expected():
    """Times of all events, and of the end: free fall, and a decay of 0.4 /s, then of 1 /s."""
    first = math.sqrt(2 * 1.25 / 10)
    second = first + 2 * 4.0 / 10
    third = second + 2 * 3.2 / 10  # beyond the limit: the ball falls on
    below = third + (-3.2 + math.sqrt(3.2 ** 2 + 2 * 10 * 0.02)) / 10
    turned = (1 - math.exp(-0.28)) / 0.4
    end = 0.7 - math.log(1 - (1.15 - turned) / math.exp(-0.28))
    return [first, 0.7, second, below, end]


def check_located(folder):
    scene = folder / "located.yaml"
    scene.write_text(SCENE)
    fmu = Fmu(scene, folder)
    importer = Importer(fmu)
    over = importer.play(2.5)
    times = expected()
    # The ball leaves the floor from below, by the width of the enclosure: a bounce has a change of sign back at once.
    found = [t for k, t in enumerate(importer.events) if k == 0 or t - importer.events[k - 1] > 1e-9]
    errors = [abs(a - b) for a, b in zip(found, times)] if len(found) == len(times) else [math.nan]
    worst = math.nan if any(e != e for e in errors) else max(errors)
    note(f"events at {', '.join(f'{t:.9f}' for t in found)}; largest error {worst:.1e} s, bound {EXACT:g}; over: {over}")
    claim("located_events_have_the_times_of_closed_forms", [] if worst <= EXACT and over else [f"{found}, {times}"])
    return fmu


def check_kept(fmu):
    """Another instance continues: occurrences, sides and parameters that an event has set are in the state."""
    one = Importer(fmu)
    one.play(1.4)
    kept = one.instance.keep()
    other = Importer(fmu)
    other.instance.restore(kept)
    other.time, other.states, other.events = one.time, one.states, []
    one.events.clear()
    ends = [importer.play(2.5) for importer in (one, other)]
    same = one.states == other.states and one.time == other.time and one.events == other.events
    note(f"end at {one.time:.9f} and {other.time:.9f} s, {len(one.events)} events")
    claim("another_instance_continues_after_events_with_equal_bits",
          [] if same and ends == [True, True] and len(one.events) >= 2 else [f"{one.states}, {other.states}"])


def check_fmusim(folder):
    """fmusim locates the events of a scene by CVODE; the run locates them by itself."""
    fmusim = os.environ.get("KT_FMUSIM")
    if not fmusim:
        skip("fmusim_locates_events", "KT_FMUSIM names no program")
        return
    problems = []
    for scene, stop in ((folder / "located.yaml", 2.5), (SCENES / "parachute.yaml", 400)):
        for version in (3, 2):
            fmu = Fmu(scene, folder, "--fmi", version)
            _, text, _ = run(COMMAND, "run", scene, "--duration", repr(stop), "--interval", repr(stop / INTERVALS),
                             "--quiet", "--out", "-")
            theirs = {round(row[0], 6): row for row in rows(text)}
            works = [k for k, name in enumerate(text.partition("\n")[0].split(",")) if name.startswith("energy.")]
            ours, complaint = play_foreign(fmusim, ["--interface-type", "me", "--solver", "cvode"], stop, fmu.archive,
                                           folder / "events.csv")
            ours = {round(time, 6): row for time, row in ours.items()}
            ended = abs(max(ours) - max(theirs))
            common = set(ours) & set(theirs)
            keep = [k for k in range(1, len(text.partition("\n")[0].split(","))) if k not in works]
            found = max((abs(ours[t][k] - theirs[t][k]) / max(1.0, abs(theirs[t][k])) for t in common for k in keep),
                        default=math.nan)
            note(f"{scene.stem}, FMI {version}: {len(common)} times, relative difference {found:.1e}, bound {FOREIGN:g}; "
                 f"the ends differ by {ended:.1e} s, bound 1e-6")
            if not (found <= FOREIGN and ended <= 1e-6 and len(common) >= INTERVALS / 2) or complaint:
                problems.append(f"{scene.stem}, FMI {version}: {found:g}, {ended:g}; {complaint}")
    claim("fmusim_locates_events", problems)


def check_events(folder):
    check_kept(check_located(folder))
    check_fmusim(folder)
