"""Tables of the book: a list of rows, each with its verdict, that become CSV and Markdown with the same digits.

A table without a title is for pages of the documentation alone. Numbers are written with two digits. Data tables hold nothing that depends on the machine or its load, so that any machine
writes the same bytes. Times go to tables of their own."""
# SPDX-License-Identifier: Apache-2.0
import csv
import math

VIOLATED = "VIOLATED"


class Table:
    def __init__(self, name, title, columns, text=(), timed=False):
        self.name, self.title, self.columns, self.text, self.timed = name, title, columns, list(text), timed
        self.rows, self.violations = [], []

    def add(self, *cells, observed=None, bound=None):
        """Appends a row; with a bound, also the columns 'observed', 'bound' and the verdict."""
        row = [show(cell) for cell in cells]
        if bound is not None:
            kept = observed <= bound  # false for NaN
            row += [show(observed), show(bound), "kept" if kept else VIOLATED]
            if not kept:
                self.violations.append(f"{self.name}: {', '.join(row)}")
        self.rows.append(row)

    def write_csv(self, path):
        with open(path, "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            writer.writerows(self.rows)

    def grid(self):
        lines = ["| " + " | ".join(self.columns) + " |", "|" + "---|" * len(self.columns)]
        return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in self.rows]) + "\n"

    def markdown(self):
        return "\n".join([f"## {self.title}", "", *(self.text and [*self.text, ""])]) + "\n" + self.grid()


def show(cell):
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return "NaN" if math.isnan(cell) else "0" if cell == 0.0 else f"{cell:.2g}"
    return str(cell)
