"""Instances of FMUs of FMI 3.0 in this process."""
# SPDX-License-Identifier: Apache-2.0
import ctypes

REAL, SIZE, FLAG, REFERENCE = ctypes.c_double, ctypes.c_size_t, ctypes.c_bool, ctypes.c_uint32
LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
UPDATE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, REAL, FLAG, FLAG, FLAG, FLAG, ctypes.POINTER(FLAG),
                          ctypes.POINTER(REAL))


def reals(values):
    return (REAL * len(values))(*values)


class Instance:
    """An instance after its initialization, or in it (`initializes`), with values of variables by name. A failure raises
    RuntimeError."""

    def __init__(self, fmu, exchange=False, start=0.0, event_mode=False, early=False, update=None,
                 initializes=False, **values):
        self.fmu, self.library, self.messages = fmu, ctypes.CDLL(str(fmu.binary)), []
        self.log = LOG(lambda _, status, category, message: self.messages.append(message.decode()))
        self.update = UPDATE(update) if update else None
        words = [b"one", fmu.root.get("instantiationToken").encode(), str(fmu.folder / "resources").encode()]
        if exchange:
            call = self.library.fmi3InstantiateModelExchange
            further = [FLAG(False), FLAG(False), None, self.log]
        else:
            call = self.library.fmi3InstantiateCoSimulation
            further = [FLAG(False), FLAG(False), FLAG(event_mode), FLAG(early), None, SIZE(0), None, self.log,
                       self.update]
        call.restype = ctypes.c_void_p
        self.instance = ctypes.c_void_p(call(*words, *further))
        if not self.instance:
            raise RuntimeError(f"no instance: {self.messages}")
        self.set(**values)
        self.call("EnterInitializationMode", FLAG(False), REAL(0), REAL(start), FLAG(False), REAL(0))
        if not initializes:
            self.call("ExitInitializationMode")
        self.time = start

    def status(self, name, *arguments):
        return getattr(self.library, "fmi3" + name)(self.instance, *arguments)

    def call(self, name, *arguments):
        if self.status(name, *arguments) != 0:
            raise RuntimeError(f"fmi3{name}: {self.messages[-1:]}")

    def references(self, names):
        return (REFERENCE * len(names))(*(int(self.fmu.reference(name)) for name in names))

    def try_set(self, **values):
        """The status of a setting."""
        size = SIZE(len(values))
        return self.status("SetFloat64", self.references(list(values)), size, reals(list(values.values())), size)

    def set(self, **values):
        if self.try_set(**values) != 0:
            raise RuntimeError(f"fmi3SetFloat64 {values}: {self.messages[-1:]}")

    def get(self, *names):
        values = (REAL * len(names))()
        self.call("GetFloat64", self.references(names), SIZE(len(names)), values, SIZE(len(names)))
        return list(values)

    def step(self, size):
        """Takes a step; returns whether an event is due, whether the run is over, and whether the step ended early."""
        flags, last = [FLAG() for _ in range(3)], REAL()
        self.call("DoStep", REAL(self.time), REAL(size), FLAG(True), *map(ctypes.byref, flags), ctypes.byref(last))
        self.time = last.value
        return [flag.value for flag in flags]

    def update_discrete(self):
        """The flags of an update, and the time of the next event."""
        flags, time = [FLAG() for _ in range(5)], REAL()
        self.call("UpdateDiscreteStates", *map(ctypes.byref, flags), ctypes.byref(time))
        return [flag.value for flag in flags], time.value

    def rates(self, time, states):
        """The derivatives of the states in continuous-time mode."""
        result = (REAL * self.fmu.states)()
        self.call("SetTime", REAL(time))
        self.call("SetContinuousStates", reals(states), SIZE(len(states)))
        self.call("GetContinuousStateDerivatives", result, SIZE(len(states)))
        return list(result)

    def states(self):
        result = (REAL * self.fmu.states)()
        self.call("GetContinuousStates", result, SIZE(self.fmu.states))
        return list(result)

    def keep(self):
        """The serialised state."""
        state, size = ctypes.c_void_p(), SIZE()
        self.call("GetFMUState", ctypes.byref(state))
        self.call("SerializedFMUStateSize", state, ctypes.byref(size))
        block = ctypes.create_string_buffer(size.value)
        self.call("SerializeFMUState", state, block, size)
        self.call("FreeFMUState", ctypes.byref(state))
        return block.raw, self.time

    def restore(self, kept):
        block, self.time = kept
        state = ctypes.c_void_p()
        self.call("DeserializeFMUState", block, SIZE(len(block)), ctypes.byref(state))
        self.call("SetFMUState", state)
        self.call("FreeFMUState", ctypes.byref(state))

    def free(self):
        self.library.fmi3FreeInstance(self.instance)
