"""Each argument of each public call: an error about an object of a wrong type names the argument."""
# SPDX-License-Identifier: Apache-2.0
import inspect

import numpy as np
import pytest

import kinetree as kt

# A right value for each argument without a default.
Q, V = np.array([0.3, 0.1]), np.zeros(2)
RIGHT = {"t": 0.0, "q": Q, "v": V, "h": 1e-3, "period": 1e-3, "tau": V, "name": "lower.mass", "value": 1.0, "function": lambda *_: 0.5, "law": lambda *_: V,
         "gain": np.zeros((2, 4)), "body": "lower", "states": 2, "format": "mjcf", "dv": V, "end": Q, "start": Q, "steps": 1, "path": "double-pendulum",
         "bodies": [kt.Body("arm", joint=kt.revolute("y"), mass=1, inertia=[1, 2, 2])], "subcommand": "check", "point": "lower", "data": b"",
         "targets": {"lower": [0, 0, 1]}, "inputs": np.zeros((3, 2)),
         "points": ["lower"], "state": 0, "vary": {"gravity[2]": [-9.0, -10.0]}, "cost": lambda *_: (0.0, np.zeros(4), V)}
FLAGS = {"on", "stop", "resume", "quiet", "show", "ok", "jacobian"}  # any truth value, and words of the command


def calls():
    """All public calls of objects of one scene, by their names."""
    scene = kt.load("double-pendulum")
    model = scene.model
    simulation = scene.simulation(step=1e-3, duration=0.01, model=model.copy())
    batch = model.batch(2, method="rk4")
    RIGHT.update({"view": batch.q, "Q": np.zeros((2, 2))})
    owners = {"kt": kt, "scene": scene, "model": model, "copy": model.copy(), "data": model.data().kinematics(Q, V, V), "simulation": simulation,
              "batch": batch, "recording": simulation.record()}
    for label, owner in owners.items():
        for name in kt.__all__ if owner is kt else [each for each in dir(owner) if not each.startswith("_")]:
            found = getattr(owner, name)
            if (inspect.isfunction(found) or inspect.ismethod(found)) and name not in ("prismatic", "revolute", "rod"):  # which a mechanism checks
                yield f"{label}.{name}", found


def parameters(call):
    """Names of the arguments that have a type, and a right value for each that is needed."""
    given = [each for each in inspect.signature(call).parameters.values() if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)]
    needed = {each.name: RIGHT.get(each.name) for each in given if each.default is each.empty or each.name in ("vary", "Q")}
    return [each.name for each in given if each.name not in FLAGS and not each.name.startswith("_")], needed


@pytest.mark.parametrize("label", [label for label, _ in calls()])
def test_an_error_about_a_wrong_type_names_the_argument(label):
    call = dict(calls())[label]
    names, needed = parameters(call)
    for name in names:
        with pytest.raises((TypeError, kt.ArgumentError)) as raised:
            call(**{**needed, name: object()})
        print(f"       {label}({name}): {raised.value}")
        assert name in str(raised.value)


def test_an_object_in_a_mechanism_is_named_by_its_place():
    for body, place in ((kt.Body("arm", mass=object(), joint=kt.revolute("y")), "bodies 'arm': mass"), (kt.Body("arm", joint=kt.revolute(object())), "bodies 'arm': joint.axis"),
                        (kt.Body("arm", shape=kt.rod(to=[1, 0, object()])), r"bodies 'arm': shape.to\[2\]")):
        with pytest.raises(TypeError, match=place):
            kt.mechanism([body])
