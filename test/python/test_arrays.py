"""Arrays: views of batches, results that the caller passes in, other packages, and copies of data."""
# SPDX-License-Identifier: Apache-2.0
import copy
import inspect
import pickle
import re

import numpy as np
import pytest

import kinetree as kt

LAG = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 0.4}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}
states: {lag: {initial: 0.5, rate: "3*(position.arm - lag)"}}
effects: [{type: expression, joint: arm, force: "-20*lag"}]
"""


def drawn(model, random_state, count):
    states = [random_state(model, seed) for seed in range(count)]
    return [np.array([state[k] for state in states]) for k in range(3)]


def test_a_batch_computes_its_memory_in_place(scenes, random_state):
    for name in ("arm7", "humanoid"):
        model, count = kt.load(scenes / f"{name}.yaml").model, 21
        Q, V, TAU = drawn(model, random_state, count)
        rows, place = model.batch(count, threads=2, method="rk4"), model.batch(count, threads=2, method="rk4")
        width = place.width
        for s in range(count):
            place.q[s // width, :, s % width], place.v[s // width, :, s % width] = Q[s], V[s]
            place.tau[s // width, :, s % width] = TAU[s]
        A = rows.forward_dynamics(Q, V, TAU)
        assert place.forward_dynamics() is place.a
        assert np.array_equal(place.rows(place.a), A) and np.array_equal(place.rows(place.q), Q)
        place.inverse_dynamics()
        assert np.array_equal(place.rows(place.tau), rows.inverse_dynamics(Q, V, A))
        place.tau[:] = 0.0
        q, v = place.step(1e-3, 3)
        wanted = rows.step(1e-3, 3, Q, V)
        assert q is place.q and np.array_equal(place.rows(q), wanted[0]) and np.array_equal(place.rows(v), wanted[1])
        again = place.step(1e-3, 1, out=(np.empty_like(Q), np.empty_like(V)))
        assert np.array_equal(again[0], place.rows(place.q))


def test_sensors_of_a_batch_have_the_bits_of_single_calls(scenes, random_state):
    for name in ("arm7", "humanoid", "four-bar"):
        model, count = kt.load(scenes / f"{name}.yaml").model, 19
        states = [random_state(model, seed) for seed in range(count)]
        Q, V, TAU = (np.array([state[k] for state in states]) for k in range(3))
        batch, data = model.batch(count, threads=2), model.data()
        points = [model.bodies[-1], model.bodies[1], *(["crank.tip"] if name == "four-bar" else [])]
        A = batch.forward_dynamics(Q, V, TAU)
        seen = batch.sense(points, jacobian=True)
        for i in range(count):
            data.kinematics(Q[i], V[i], A[i])
            for k, point in enumerate(points):
                wanted = {"position": data.position(point), "velocity": data.velocity(point), "acceleration": data.acceleration(point),
                          "jacobian": data.jacobian(point)}
                assert all(np.array_equal(seen[each][i, k], wanted[each]) for each in wanted), (name, point, i)
                assert np.array_equal(seen["rotation"][i, k], data.pose(point.split(".")[0])[0])
                assert np.abs(wanted["jacobian"][:3] @ V[i] - seen["angular_velocity"][i, k]).max() < 1e-12
        assert np.abs(seen["acceleration"]).max() > 1 and np.abs(seen["angular_acceleration"]).max() > 1 and "jacobian" not in batch.sense(points)
    for wrong in ("crank", [], ["crank.tap"], [7], None):
        with pytest.raises(kt.ArgumentError, match="points|point|body"):
            batch.sense(wrong)


def test_results_are_written_to_arrays_of_the_caller(scenes, random_state):
    model = kt.load(scenes / "arm7.yaml").model
    data, n = model.data(), model.nv
    q, v, tau = random_state(model, 4)
    square = [np.empty((n, n), order="F") for _ in range(3)]
    cases = [
        (lambda out: data.forward_dynamics(q, v, tau, out=out), np.empty(n)),
        (lambda out: data.inverse_dynamics(q, v, tau, out=out), np.empty(n)),
        (lambda out: data.mass_matrix(q, out=out), np.empty((n, n))),
        (lambda out: data.bias(q, v, out=out), np.empty(n)),
        (lambda out: data.effect_forces(q, v, out=out), np.empty(n)),
        (lambda out: data.forward_derivatives(q, v, tau, out=out), tuple(square)),
        (lambda out: data.step(1e-3, q, v, tau, out=out), (np.empty(n), np.empty(n))),
        (lambda out: data.step_derivatives(1e-3, q, v, tau, out=out), (np.empty((2 * n, 2 * n), order="F"), np.empty((2 * n, n), order="F"))),
        (lambda out: data.project(q, v, out=out), (np.empty(n), np.empty(n))),
        (lambda out: data.assemble(q, v, out=out), (np.empty(n), np.empty(n))),
        (lambda out: data.kinematics(q, v, tau).position(model.bodies[-1], out), np.empty(3)),
        (lambda out: data.velocity(model.bodies[-1], out), np.empty(3)),
        (lambda out: data.acceleration(model.bodies[-1], out), np.empty(3)),
        (lambda out: data.pose(model.bodies[-1], out), (np.empty((3, 3)), np.empty(3))),
        (lambda out: data.jacobian(model.bodies[-1], out), np.empty((6, n), order="F")),
        (lambda out: model.add(q, v, out), np.empty(n)),
        (lambda out: model.subtract(q, v, out), np.empty(n)),
    ]
    for call, out in cases:
        fresh, found = call(None), call(out)
        for each, own, given in zip(*[x if isinstance(x, tuple) else (x,) for x in (fresh, found, out)]):
            assert own is given and np.array_equal(each, own)
        wrong = tuple(np.empty(99) for _ in out) if isinstance(out, tuple) else np.empty(99)
        with pytest.raises(kt.ArgumentError, match="out.*expected a writable array of float64"):
            call(wrong)
        read_only = np.empty(out.shape, order="F") if isinstance(out, np.ndarray) and out.ndim == 2 else np.empty(n)
        read_only.flags.writeable = False
        with pytest.raises(kt.ArgumentError, match="out"):
            call(read_only)
    assert len(cases) == 17


def test_a_call_that_fails_leaves_its_outputs(scenes):
    """`project` and `assemble` wrote their inputs to `out` before they computed, so that out=(v, q) exchanged nothing but lost v."""
    model = kt.load(scenes / "four-bar.yaml").model
    data = model.data()
    q, v = data.assemble()
    for call in (data.project, data.assemble, lambda q, v, out: data.step(1e-3, q, v, 0 * v, out=out)):
        out = np.full(model.nq, 7.0), np.full(model.nv, 7.0)
        with pytest.raises(kt.StepError):
            call(np.nan * q, v, out=out)
        assert (np.array(out) == 7.0).all()
        first, second = q.copy(), v.copy()
        assert all(np.array_equal(*pair) for pair in zip(call(first, second, out=(second, first)), call(q, v, out=out)))


def test_arrays_of_doubles_take_the_short_way_and_others_give_equal_bits(scenes, random_state, monkeypatch):
    model = kt.load(scenes / "arm7.yaml").model
    data, n = model.data(), model.nv
    q, v, tau = random_state(model, 6)
    read_only = np.empty(n)
    read_only.flags.writeable = False
    slow = [np.repeat(q, 2)[::2], q.astype(">f8"), q[:, None], q.astype(np.float32), q.tolist(), np.ma.array(q), np.zeros(n + 1), "q",
            np.frombuffer(b"\0" + q.tobytes(), np.uint8)[1:].view(np.float64)]
    for name, third in (("forward_dynamics", "tau"), ("inverse_dynamics", "a")):
        call = getattr(data, name)
        found = call(q, v, tau)
        assert type(found) is np.ndarray and np.array_equal(found, call(slow[0], v, tau)) and np.array_equal(found, call(slow[1], v, tau))
        with monkeypatch.context() as patch:
            patch.setattr(kt.Data, f"_convert_{name}", lambda *args, **words: (args[1:], words))
            assert np.array_equal(found, call(q, out=None, v=v, **{third: tau}))
            for each in slow:
                assert call(each, v, out=None, **{third: tau}) == ((each, v), {"out": None, third: tau})
            for each in (read_only, np.empty(n + 1), np.empty((n, 1)), np.empty(n, np.float32), "x"):
                assert call(q, v, tau, out=each) == ((q, v, tau), {"out": each})
            assert call(q, q=q) == ((q,), {"q": q}) and call(q, v, tau, 0.0) == ((q, v, tau, 0.0), {}) and call(q, s=1) == ((q,), {"s": 1})
        for wrong in ({"t": "t"}, {"s": 1}, {"q": q}):
            with pytest.raises((TypeError, kt.ArgumentError)):
                call(q, v, tau, **wrong)
        with pytest.raises(kt.StepError):
            call(np.full(n, np.nan), v, tau)
    with pytest.raises(AttributeError):
        kt.Data.__new__(kt.Data).forward_dynamics()
    data.q, data.v, data.tau = q, v, tau
    assert data.forward_dynamics() is data.a and np.array_equal(data.a, data.forward_dynamics(q, v, tau))


def test_methods_of_c_have_the_signature_and_the_text_of_python():
    for name in ("forward_dynamics", "inverse_dynamics"):
        quick, python = getattr(kt.Data, name), getattr(kt.Data, f"_convert_{name}")
        parameters = [[(each.name, each.kind, each.default) for each in list(inspect.signature(call).parameters.values())[1:]] for call in (quick, python)]
        assert quick.__name__ == name and quick.__doc__ == python.__doc__ and parameters[0] == parameters[1]


def test_arrays_of_another_layout_would_not_be_read():
    from kinetree import _kinetree
    known = np.zeros((2, 3))
    right = (np.ndarray, known.dtype, np.empty, known, known.ctypes.data, known.flags.num)
    wrong = [(*right[:4], right[4] + 8, right[5]), (*right[:5], right[5] ^ 1), (*right[:3], np.zeros((3, 2)), *right[4:]), (*right[:3], 7, *right[4:]),
             (right[0], np.dtype(np.float32), *right[2:])]
    assert _kinetree.learn(*right) and not any(_kinetree.learn(*each) for each in wrong)


def test_inputs_that_are_no_rows_of_doubles_are_converted_or_rejected(scenes, random_state):
    model = kt.load(scenes / "arm7.yaml").model
    data = model.data()
    q, v, tau = random_state(model, 5)
    a = data.forward_dynamics(q, v, tau)
    doubled = np.repeat(q, 2)[::2]
    assert not doubled.flags.c_contiguous and np.array_equal(data.forward_dynamics(doubled, v, tau), a)
    assert np.array_equal(data.forward_dynamics(list(q), tuple(v), tau.astype(">f8")), a)
    for wrong in ("q", 1j * q, [object()] * 7, {"q": 1}, np.zeros((7, 1)), np.zeros(8), q[:, None]):
        with pytest.raises(kt.ArgumentError, match="^q: expected"):
            data.forward_dynamics(wrong, v, tau)
    with pytest.raises(kt.ArgumentError, match=r"q: expected shape \(7,\), got \(\)"):
        data.forward_dynamics(0.0, v, tau)
    batch = model.batch(3)
    with pytest.raises(kt.ArgumentError, match=r"Q: expected shape \(3, 7\), got \(7,\)"):
        batch.forward_dynamics(q)
    with pytest.raises(kt.ArgumentError, match="V: it needs Q"):
        batch.forward_dynamics(V=np.zeros((3, 7)))


def test_other_packages_share_the_memory_by_dlpack(scenes):
    model = kt.load(scenes / "arm7.yaml").model
    batch, data = model.batch(9), model.data()
    simulation = kt.load(scenes / "arm7.yaml").simulation(step=1e-3)
    for array in (batch.q, batch.v, batch.tau, batch.a, data.q, data.tau, simulation.torque):
        other = np.from_dlpack(array)
        array[:] = 0.25
        assert np.shares_memory(other, array) and (np.asarray(other) == 0.25).all()
        assert array.__dlpack_device__() == (1, 0)  # the memory of processors


def test_copies_of_data_have_its_state_and_memory_of_their_own(random_state):
    data = kt.Scene(LAG).model.data()
    data.q, data.v, data.tau, data.x = [0.3], [1.5], [0.2], [0.7]
    a = data.forward_dynamics()[0]
    for other in (copy.deepcopy(data), pickle.loads(pickle.dumps(data))):
        assert other.forward_dynamics()[0] == a and other.x[0] == 0.7
        other.q[0] = 2.0
        assert data.q[0] == 0.3


def test_views_of_a_batch_outlive_it(scenes):
    batch = kt.load(scenes / "arm7.yaml").model.batch(64)
    q = batch.q
    q[:] = 0.5
    del batch
    _ = [bytearray(1 << 20) for _ in range(16)]
    assert (q == 0.5).all()
    q[:] = 1.0


def test_results_become_frames_and_plots(scenes):
    run = kt.load(scenes / "double-pendulum.yaml").run(duration=0.2)
    pandas = pytest.importorskip("pandas", reason="pandas is not on this machine")
    frame = run.to_frame()
    assert isinstance(frame, pandas.DataFrame) and list(frame.columns) == run.names and (frame["time"] == run.time).all()


def test_a_plot_has_the_columns_that_match(scenes):
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not on this machine")
    matplotlib.use("agg")
    run = kt.load(scenes / "double-pendulum.yaml").run(duration=0.2)
    axes = run.plot("position.*")
    assert [line.get_label() for line in axes.get_lines()] == list(run.matching("position.*"))
    assert np.array_equal(axes.get_lines()[1].get_ydata(), list(run.matching("position.*").values())[1])
    with pytest.raises(KeyError, match="no column matches"):
        run.plot("positon.*")
    with pytest.raises(KeyError, match="did you mean 'position.upper'"):
        run.plot("position.uper")


def test_a_plot_has_the_panels_and_colours_of_the_command(scenes, tmp_path):
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not on this machine")
    matplotlib.use("agg")
    run = kt.load(scenes / "four-bar.yaml").run(duration=0.2, out=tmp_path / "run.csv")
    panels = run.plot("position.*", "marker.*.[xy]")
    assert [each.get_title("left") for each in panels] == ["Position, rad", "Marker, m"]
    assert [len(each.get_lines()) for each in panels] == [3, 6]
    kt.command.run("plot", str(tmp_path / "run.csv"), "--columns", "position,marker", "--out", str(tmp_path / "run.svg"))
    svg = (tmp_path / "run.svg").read_text()
    ours = [line.get_color() for each in panels for line in each.get_lines()]
    theirs = [each for each in re.findall(r'stroke(?::|=")(#[0-9a-f]{6})', svg)]
    quiet, faint = (matplotlib.colors.to_hex(each) for each in (panels[0].spines["left"].get_edgecolor(), panels[0].get_xgridlines()[0].get_color()))
    curves = [each for each in theirs if each not in (quiet, faint)]
    print("       colours of curves and keys:", len(curves), "of", len(theirs))
    assert quiet in theirs and faint in theirs
    assert curves == [*ours[:3], *ours[:3], *ours[3:], *ours[3:]]  # of each panel the curves, then the legend
