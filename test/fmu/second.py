"""FMUs with the functions of FMI 2.0 (fmu.py)."""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import ctypes
import math

from archive import STEP, STEPS, Fmu, differences, fixed_scene, records, rows
from claims import claim, note
from complaints import pushed_scene
from instance import REAL, REFERENCE, SIZE


class Second:
    """An instance of FMI 2.0 in this process, after its initialization unless it only `begins`. Calls must return 0."""

    LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)

    def __init__(self, fmu, exchange, begins=False):
        self.library, self.messages = ctypes.CDLL(str(fmu.binary)), []
        self.log = self.LOG(lambda *words: self.messages.append(words))
        self.callbacks = (ctypes.c_void_p * 5)(ctypes.cast(self.log, ctypes.c_void_p).value)
        self.library.fmi2Instantiate.restype = ctypes.c_void_p
        uri = "file://" + str(fmu.folder / "resources").replace("e", "%65")
        self.instance = ctypes.c_void_p(self.library.fmi2Instantiate(
            b"one", 0 if exchange else 1, fmu.root.get("guid").encode(), uri.encode(), self.callbacks, 0, 0))
        if not begins:
            self.begin(0.0)
            self.call("ExitInitializationMode")

    def begin(self, start):
        self.call("SetupExperiment", *experiment(start))
        self.call("EnterInitializationMode")

    def status(self, name, *arguments):
        return getattr(self.library, "fmi2" + name)(self.instance, *arguments)

    def call(self, name, *arguments):
        if not self.instance or self.status(name, *arguments) != 0:
            raise RuntimeError(f"fmi2{name}: {self.messages}")

    def real(self, references):
        values = (REAL * len(references))()
        self.call("GetReal", (REFERENCE * len(references))(*references), SIZE(len(references)), values)
        return list(values)

    def keep(self):
        """A copy of the state, as an address."""
        state = ctypes.c_void_p()
        self.call("GetFMUstate", ctypes.byref(state))
        return state


def experiment(start):
    """The arguments of SetupExperiment."""
    return 0, REAL(0), REAL(start), 0, REAL(0)


def second_play(fmu):
    """Rows of co-simulation with FMI 2.0, as those of the importer."""
    second, table = Second(fmu, False), []
    for k in range(STEPS + 1):
        if k > 0:
            second.call("DoStep", REAL((k - 1) * STEP), REAL(STEP), 1)
        table.append(second.real([int(word) for word in fmu.outputs()]))
    second.library.fmi2FreeInstance(second.instance)
    return table


def wrong_places(fmu):
    """Faults of the places of variables in a list, by which FMI 2.0 refers to them."""
    variables = list(fmu.root.find("ModelVariables"))
    problems = [v.get("name") for v in variables if v[0].get("derivative") is not None
                and v.get("name") != f"der({variables[int(v[0].get('derivative')) - 1].get('name')})"]
    for group, kinds in (("Outputs", "output"), ("Derivatives", "local"), ("InitialUnknowns", None)):
        for unknown in fmu.root.find(f"ModelStructure/{group}"):
            v = variables[int(unknown.get("index")) - 1]
            if (kinds and v.get("causality") != kinds) or v.get("initial") != "calculated":
                problems.append(f"{group}: {v.get('name')}")
    return problems


def sequence(fmu, exchange):
    """Calls that the standard does not allow, in each phase. Returns those that pass, or change the state."""
    one, passed = Second(fmu, exchange, begins=True), []
    push = (REFERENCE * 1)(int(fmu.reference("input.slide"))), SIZE(1), (REAL * 1)(3.0)
    calls = {"SetupExperiment": experiment(1.0), "EnterInitializationMode": (), "ExitInitializationMode": (),
             "Terminate": (), "SetReal": push, "EnterEventMode": (), "EnterContinuousTimeMode": (),
             "NewDiscreteStates": ((ctypes.c_int * 8)(),), "DoStep": (REAL(2), REAL(0.5), 1)}

    def reject(phase, *names):
        for name in names:
            before = one.real([0, *map(int, fmu.outputs())])
            if one.status(name, *calls[name]) != 3 or one.real([0, *map(int, fmu.outputs())]) != before:
                passed.append(f"{name} {phase}, {'model exchange' if exchange else 'co-simulation'}")

    run = ("EnterEventMode", "EnterContinuousTimeMode", "NewDiscreteStates", "DoStep")
    reject("before the initialization", "ExitInitializationMode", "Terminate", *run)
    if one.status("SetupExperiment", *experiment(math.nan)) != 3:
        passed.append("SetupExperiment with NaN")
    one.begin(2.0)
    reject("in the initialization", "SetupExperiment", "EnterInitializationMode", "Terminate", *run)
    one.call("ExitInitializationMode")
    reject("in the run", "SetupExperiment", "EnterInitializationMode", "ExitInitializationMode",
           *(("EnterEventMode", "DoStep") if exchange else run[:3]))
    one.call("Terminate")
    reject("at the end", *calls)
    return passed


def check_sequences(folder):
    """The table of functions and states of the standard; and the start, which is a part of the state of an FMU."""
    fmu = Fmu(pushed_scene(folder), folder, "--fmi", 2, "--input", "slide")
    passed = sequence(fmu, False) + sequence(fmu, True)
    claim("calls_out_of_sequence_are_rejected_and_change_nothing", passed)
    found = []
    for exchange in (False, True):
        one, other = Second(fmu, exchange, begins=True), Second(fmu, exchange)
        kept = one.keep()
        one.call("SetupExperiment", *experiment(5.0))
        later = one.keep()
        for state in (kept, later):
            for instance in (one, other):
                instance.call("SetFMUstate", state)
                instance.call("EnterInitializationMode")
                found += instance.real([0])
    note(f"starts {found}")
    claim("a_state_of_fmi_2_holds_its_start", [] if found == [0, 0, 5, 5] * 2 else [str(found)])


def outputs_of(fmu):
    """The outputs of a motion in steps of 1 s, which take milliseconds each."""
    one, seen = Second(fmu, False), []
    for k in range(10):
        one.call("DoStep", REAL(k), REAL(1), 1)
        seen += one.real([int(word) for word in fmu.outputs()])
    one.library.fmi2FreeInstance(one.instance)
    return bytes((REAL * len(seen))(*seen))


def check_threads(folder):
    """Eight instances in as many threads. They run at the same time, since calls release the lock of Python."""
    problems, count = [], 0
    for name in ("arm7", "four-bar", "bouncing-ball", "lugre"):
        fmu = Fmu(fixed_scene(name, folder), folder, "--fmi", 2)
        alone = outputs_of(fmu)
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            others = list(pool.map(lambda _: outputs_of(fmu), range(8)))
        problems += [f"{name}: instance {k}" for k, other in enumerate(others) if other != alone]
        count += len(alone) // 8
    note(f"{count} numbers in each of eight threads")
    claim("instances_in_threads_have_the_bits_of_one_alone", problems + ([] if count >= 500 else ["too few numbers"]))


def check_second(folder):
    """FMI 2.0: the bits of the run in co-simulation, those of FMI 3.0 in model exchange, and the places of variables."""
    bits, places = [], []
    for name, options in (("arm7", ["--input", "elbow"]), ("bouncing-ball", []), ("thruster-lag", [])):
        scene = fixed_scene(name, folder)
        fmu = Fmu(scene, folder, "--fmi", 2, *options)
        places += [f"{name}: {fault}" for fault in wrong_places(fmu)]
        table = second_play(fmu)
        times = {row[0] for row in table}
        found = differences(table, [row for row in records(scene)[0] if row[0] in times])
        note(f"{name}: largest difference {found:g}, bound 0")
        bits += [] if found == 0.0 else [f"{name}: {found:g}"]
    claim("cosimulation_of_fmi_2_has_the_bits_of_a_run", bits)
    claim("descriptions_of_fmi_2_refer_to_the_right_places", places)
    scene, exchanged = fixed_scene("arm7", folder), []
    second, third = Second(Fmu(scene, folder, "--fmi", 2), True), Fmu(scene, folder)
    rates = [int(v.get("valueReference")) for v in third.variables.values() if v.get("derivative")]
    states = [int(v.get("derivative")) for v in third.variables.values() if v.get("derivative")]
    derivatives, event = (REAL * len(rates))(), (ctypes.c_int * 8)()
    second.call("NewDiscreteStates", event)
    second.call("EnterContinuousTimeMode")
    second.call("GetDerivatives", derivatives, SIZE(len(rates)))
    _, text, _ = third.play("me", *map(str, rates), steps=1)
    found = differences([list(derivatives)], rows(text)[:1])
    # The derivative of q' = v along v alone is the direction itself.
    seed = [math.sin(k + 1) if k >= len(rates) // 2 else 0.0 for k in range(len(rates))]
    result = (REAL * len(rates))()
    second.call("GetDirectionalDerivative", (REFERENCE * len(rates))(*rates), SIZE(len(rates)),
                (REFERENCE * len(rates))(*states), SIZE(len(rates)), (REAL * len(rates))(*seed), result)
    along = differences([list(result)[:len(rates) // 2]], [seed[len(rates) // 2:]])
    note(f"arm7: derivatives differ by {found:g}, those along a direction by {along:g}, bound 0")
    exchanged += [] if found == 0.0 and along == 0.0 else [f"{found:g}, {along:g}"]
    claim("model_exchange_of_fmi_2_is_that_of_fmi_3", exchanged)
    check_sequences(folder)
    check_threads(folder)
