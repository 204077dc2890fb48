"""hil PROGRAM CLIENT: a stranger's controller keeps the pole up across UDP, and the plant bears what a wire may do.

All runs but the last are in lock-step, so that no load on the machine makes a difference.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

PLANT, CLIENT = sys.argv[1:3]


class Run:
    """The plant, and what controls it: the client's arguments, or a function of the port; None: nobody."""

    def __init__(self, arguments, control):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "hil.csv"
            plant = subprocess.Popen([PLANT, "--csv", path, *arguments], stdout=subprocess.PIPE, text=True)
            try:
                port = int(plant.stdout.readline().split()[1])
                if callable(control):
                    control(port)
                else:
                    client = subprocess.run([CLIENT, str(port), *control], capture_output=True, text=True, timeout=600)
                    note(f"client: {client.stdout.strip()}")
                self.text = plant.communicate(timeout=600)[0]
            finally:
                plant.kill()
            self.rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(path.open())]
        note(self.text.strip().replace("\n", "\n       "))
        self.status = plant.returncode
        numbers = [int(word) for word in self.text.split("\n")[0].replace(",", "").split() if word.isdigit()]
        self.ticks, self.commands, self.lost, self.off = numbers if len(numbers) == 4 else (0, 0, 0, 0)
        self.angle = max((abs(row["position.pole"]) for row in self.rows[len(self.rows) * 3 // 4:]), default=9.0)

    def forces_after(self, time):
        return {row["force"] for row in self.rows if row["time"] > time}


def garble(port):
    """Hello, then nothing but what is wrong: other words, other lengths, ticks to come, no numbers, a huge force."""
    wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    wire.settimeout(10)
    generator = random.Random(1)

    def command(tick, force):
        wire.sendto(b"KTC1" + struct.pack("<Id", tick, force), ("127.0.0.1", port))

    command(0, 0.0)
    for tick in range(1, 201):
        while struct.unpack("<I", wire.recv(100)[4:8])[0] != tick:
            pass
        for length in (0, 1, 15, 16, 17, 500):
            wire.sendto(generator.randbytes(length), ("127.0.0.1", port))
        command(tick + 5, 1.0)
        command(tick, float("nan"))
        command(tick - 1, 2.0)
        command(tick, 1e9)
    wire.close()


steady = Run(["--lockstep", "--duration", "4"], [])
claim("client_balances_the_pole", [] if steady.status == 0 and steady.angle < 0.002 else [f"{steady.angle} rad"])
claim("every_state_is_answered", [] if (steady.ticks, steady.commands, steady.off) == (4000, 4000, 0) else [steady.text])
claim("pole_started_well_off", [] if steady.rows and steady.rows[0]["position.pole"] > 0.14 else ["upright"])
again = Run(["--lockstep", "--duration", "4"], [])
claim("lock_step_gives_the_same_bits_again", [] if again.rows == steady.rows and again.rows else ["they differ"])

lossy = Run(["--lockstep", "--duration", "4", "--lose", "30"], [])
claim("three_of_ten_commands_may_be_lost",
      [] if 1000 < lossy.lost < 1400 and lossy.lost + lossy.commands == 4000 and lossy.angle < 0.002 else [lossy.text])

silent = Run(["--lockstep", "--duration", "3"], ["500"])
claim("force_is_zero_when_commands_stay_away",
      [] if silent.commands == 500 and silent.forces_after(0.53) == {0.0} and silent.off == 3000 - 520 else [silent.text])
claim("without_commands_the_pole_falls", [] if silent.angle > 1.0 else [f"{silent.angle} rad"])

bad = Run(["--lockstep", "--duration", "0.3"], garble)
claim("what_is_no_command_is_dropped_and_forces_are_limited",
      [] if bad.status == 0 and bad.commands == 200 and bad.forces_after(-1) == {0.0, 20.0} else [bad.text])

# Paced at 1 kHz a loaded machine may leave commands out, but not ticks.
paced = Run(["--duration", "0.5"], [])
claim("paced_run_ends_after_its_time", [] if paced.status == 0 and paced.ticks == 500 else [paced.text])
claim("paced_run_takes_commands", [] if paced.commands > 0 else [paced.text])
finish()
