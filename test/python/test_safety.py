"""Nothing that Python passes crashes the interpreter, and arrays outlive what they belong to."""
import gc
import os
import pathlib
import re
import subprocess
import sys
import threading

import numpy as np
import pytest

import kinetree as kt

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_every_public_function_is_reachable():
    """Names from the headers by a pattern of this test, not by the parser that made the module."""
    names = set()
    for header in (ROOT / "include/kinetree").glob("*.h"):
        text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.S)
        names |= set(re.findall(r"KT_API[^;(]*?\b(kt_\w+)\(", text))
    missing = sorted(name for name in names if not hasattr(kt.lib, name))
    print(f"       {len(names)} public functions, {len(missing)} missing")
    assert len(names) > 400 and not missing


def test_every_subcommand_is_reachable(scenes):
    said = subprocess.run([kt.command.path(), "help"], capture_output=True, text=True, check=True).stdout
    for name in re.findall(r"^  ([a-z]+)  +\w", said.split("Usage", 1)[1].split("Exit status", 1)[0], flags=re.M):
        assert kt.command.run(name, "--help").stdout


def test_views_are_the_memory_of_c_and_keep_it_alive(scenes):
    simulation = kt.load(scenes / "double-pendulum.yaml").simulation(step=1e-3, duration=1.0)
    positions = simulation.positions
    before = positions.copy()
    simulation.tick(1e-3)
    assert positions is simulation.positions and not (positions == before).all() and not positions.flags.writeable
    last = positions.copy()
    del simulation
    gc.collect()
    _ = [bytearray(1 << 20) for _ in range(16)]
    assert (positions == last).all()


def test_arrays_of_data_cannot_be_moved():
    data = kt.mechanism([kt.Body("rod", joint=kt.revolute("y"), mass=1, shape=kt.rod(to=[1, 0, 0]))]).model.data()
    with pytest.raises(ValueError):
        data.q.resize(10)
    held = data.q
    data.q = [0.25]
    assert data.q is held and held[0] == 0.25


def test_wrong_shapes_name_the_argument():
    data = kt.mechanism([kt.Body("rod", joint=kt.revolute("y"), mass=1, shape=kt.rod(to=[1, 0, 0]))]).model.data()
    with pytest.raises(kt.ArgumentError, match=r"tau: expected shape \(1,\), got \(2,\)"):
        data.forward_dynamics(np.zeros(1), np.zeros(1), np.zeros(2))
    with pytest.raises(kt.ArgumentError, match="out: expected a writable array"):
        data.forward_dynamics(np.zeros(1), np.zeros(1), out=np.zeros(1, np.float32))
    with pytest.raises(kt.Error):
        data.forward_dynamics(np.array([np.nan]))
    with pytest.raises(kt.SceneError, match="did you mean 'crank'"):
        kt.Scene("kinetree: 1\nbodies:\n  - {name: crank, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                 "  - {name: b, parent: crnak, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n")


def test_a_second_thread_is_rejected_and_two_data_are_not(scenes):
    scene = kt.load(scenes / "double-pendulum.yaml")
    results, shared = [], scene.simulation(step=1e-4, duration=1.0)
    busy = []

    def advance():
        try:
            shared.advance(1.0)
        except kt.Busy:
            busy.append(1)

    threads = [threading.Thread(target=advance) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert shared.time == 1.0 and len(busy) <= 3

    def own():
        simulation = scene.simulation(step=1e-3, duration=1.0)
        simulation.advance(1.0)
        results.append(simulation.positions.copy())

    threads = [threading.Thread(target=own) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((each == results[0]).all() for each in results) and len(results) == 4


FUZZ = """
import random, sys, time
import numpy as np
import kinetree as kt
draw = random.Random(int(sys.argv[1]))
scene = kt.load(sys.argv[3])
odd = [None, -1, 0, 1, 2**40, -2**63, 2**70, 1e308, float('nan'), float('inf'), '', 'x', 'a\\0b', b'x', [], [1.0], {}, (), object(), np.zeros(0),
       np.zeros(3), np.full(2, np.nan), np.zeros((2, 2)), np.zeros(2, np.float32), np.array(['a']), np.zeros(8)[::2], True, 1j, lambda *a: 1.0, kt, 'arm.mass']
data, simulation, batch = scene.model.data(), scene.simulation(step=1e-3), scene.model.batch(3, method='rk4')
objects = [data, simulation, batch, scene.model, scene.model.copy()]
skip = {'run', 'advance', 'tick', 'step'}  # these may take a year of the motion, as asked
end, calls, raised = time.time() + float(sys.argv[2]), 0, 0
while time.time() < end:
    target = draw.choice(objects)
    name = draw.choice([each for each in dir(target) if not each.startswith('_') and each not in skip])
    call = None
    try:
        call = getattr(target, name)
        if callable(call):
            call(*[draw.choice(odd) for _ in range(draw.randrange(5))])
        elif draw.random() < 0.5:
            setattr(target, name, draw.choice(odd))
    except MemoryError:
        raised += 1
    except Exception:
        raised += 1
    calls += 1
    if calls % 200 == 0:
        data, simulation = scene.model.data(), scene.simulation(step=draw.choice([1e-3, 1e-2]))
        batch = scene.model.batch(draw.randrange(1, 9), method='rk4')
        objects = [data, simulation, batch, scene.model, scene.model.copy()]
    if calls % 50 == 0:
        for maker in (kt.Scene, kt.load, scene.simulation, scene.model.batch, scene.model.point, kt.Simulation):
            try:
                maker(draw.choice(odd), **({} if draw.random() < 0.5 else {draw.choice(['step', 'duration', 'integrator', 'set', 'threads']): draw.choice(odd)}))
            except Exception:
                raised += 1
print(calls, raised)
"""


@pytest.mark.parametrize("seed", [1, 2])
def test_random_arguments_never_end_the_interpreter(seed, scenes):
    seconds = os.environ.get("KT_FUZZ_SECONDS", "5")
    done = subprocess.run([sys.executable, "-c", FUZZ, str(seed), seconds, str(scenes / "double-pendulum.yaml")],
                          capture_output=True, text=True, timeout=120 + float(seconds))
    print("       calls, exceptions:", done.stdout.strip())
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout.split()[0]) > 100
