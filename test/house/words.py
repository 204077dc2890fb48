"""The field's words, held in the sources: a name that only its builders knew does not come back.

words.py SOURCE-ROOT

CODE are identifiers, or parts of identifiers between underscores, that no code has; comments and texts are not read for
them, since many are good English there. TEXT are patterns of phrases that stand nowhere: not in code, comments, messages or pages.
Each line says what stands in its place. Where a word is the field's own for something else, its files are named.

Words that mean something else in many files are not asked, since a list of these would say nothing: turn (2 pi), group,
place, far, whole, base, held, kept, seen, share, close, cross (product), show.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

# word, what is said instead, where it means something else
CODE = [
    ("look", "residuals, evaluate", ()),
    ("looks", "residuals, evaluations", ()),
    ("live", "active", ("apps/",)),
    ("judge", "check", ("apps/", "lib/study/compare/")),
    ("keep", "store, save", ("apps/", "lib/files/", "lib/output/", "lib/study/", "lib/math/")),
    ("noted", "stored, marked", ("apps/", "lib/files/")),
    ("ready", "prepare; has_terms", ("apps/embed/",)),  # a file descriptor of poll
    ("unsolved", "singular", ()),
    ("unsolve", "refactor", ()),
    ("kt_rest", "kt_statics", ()),
    ("few", "delassus", ()),
    ("narrow", "front4", ()),
    ("saddle", "kkt", ()),
    ("touch", "link_acceleration; contact; penetration", ()),
    ("unseen", "free", ()),
    ("waits", "pending, delayed", ("lib/files/scene/scene_expression.c", "apps/kinetree/records/lines.c")),
    ("leave", "last_use, store", ("lib/mechanics/compile/mechanism_inertia.c", "lib/output/picture/", "lib/math/expression/", "apps/kinetree/draw/")),
    ("descend", "forward or backward pass, iterate", ()),
    ("weigh", "apply_mass, set_inertia, weight", ()),
    ("weighs", "weight", ()),
    ("push", "propagate, wrench", ("lib/files/robot/mjcf_force.c", "apps/kinetree/draw/depth.c")),  # a function of cairo
    ("pushed", "wrench", ()),
    ("geared", "has_armature", ("lib/files/robot/urdf",)),
    ("level", "isa", ("lib/motion/integrator/order.c", "lib/files/document/emit", "lib/output/picture/camera.c", "apps/kinetree/text/tree.c")),
    ("bend", "bias, second derivative",  # where a path next to a singular position bends
     ("lib/mechanics/evaluate/singular_crossing.c", "include/kinetree/model.h", "lib/motion/simulation/simulation_step.c", "lib/motion/simulation/fail.c", "lib/motion/simulation/checkpoint_words.c", "apps/kinetree/")),
    ("rise", "time_derivative", ("apps/embed/",)),
    ("slopes", "jacobian; stages k_i, and of tables", ("lib/motion/integrator/", "include/kinetree/integrator.h", "include/kinetree/method.h", "lib/motion/simulation/", "lib/motion/sensitivity/", "lib/study/compare/dae.c",
      "include/kinetree/function.h", "lib/math/expression/lookup.", "lib/model/model/curve.c", "lib/model/model/check_function.c", "lib/files/scene/scene_function.c", "apps/firmware/left_out.c")),
    ("fold", "make_reflector", ()),
    ("unfold", "expand_reflector", ()),
    ("come_nearer", "nearest_on_manifold", ()),
    ("bearer", "force frame", ()),
    ("wish", "options", ()),
    ("freedom", "dof", ()),
    ("freedoms", "dofs", ()),
    ("slide", "prismatic", ("lib/mechanics/dynamics/aba_inverse_passes.c", "lib/mechanics/dynamics/inertia_check.c", "lib/mechanics/control/frame.c", "lib/mechanics/compile/find_planar.c")),
    ("helix", "screw", ("lib/files/scene/scene_form.c", "lib/model/loop/gear.c", "lib/model/loop/point_on_curve.c", "lib/output/picture/stroke.c", "include/kinetree/description.h")),  # a curve, and the angle of teeth
    ("ball", "spherical", ("lib/files/robot/write_mjcf.c", "lib/files/robot/mjcf_force.c", "apps/kinetree/draw/solid.c")),  # MJCF's; a solid
    ("node", "constraint group",  # of a text; of the recursion over degrees of freedom; of glTF; of a graph of operations; of a finite element
     ("lib/output/codegen/", "lib/files/scene/", "lib/files/document/", "lib/mechanics/dynamics/", "lib/mechanics/derivative/effect_", "lib/mechanics/derivative/gravity_force.c", "lib/mechanics/evaluate/effects.h", "lib/mechanics/evaluate/singular_crossing.c", "lib/model/loop/", "lib/motion/simulation/", "apps/kinetree/view/")),
    ("chart", "independent coordinates", ("apps/kinetree/subcommands/", "apps/kinetree/plot/")),  # a picture
    ("drive", "wrench, joint_force", ()),
    ("pushes", "inputs", ()),
    ("way", "path, support, direction", ()),
    ("way_out", "forward_pass", ()),
    ("way_back", "backward_pass", ()),
    ("tangent", "dual number, complex step", ("lib/motion/sensitivity/", "lib/motion/step/", "lib/motion/simulation/", "lib/motion/contact/", "lib/study/compare/")),  # of a step's map
    ("kt_root", "kt_sqrt", ()),
    ("kt_raise", "kt_pow", ()),
    ("kt_angle", "kt_atan2", ()),
    ("face", "surface", ("lib/files/mesh/", "lib/output/picture/", "apps/kinetree/draw/", "apps/kinetree/subcommands/draw.c", "apps/kinetree/plot/")),
    ("tells", "reports", ()),
    ("tell", "report", ("lib/files/scene/vary.c", "apps/notes/")),
    ("see", "sync", ()),
    ("told", "known, reported", ("apps/embed/identify_arm.c",)),
    ("carry", "parent_coupling, propagate", ("lib/mechanics/constraint/planar_gradient.c", "lib/mechanics/dynamics/body_frames.c", "lib/mechanics/dynamics/total.c")),
    ("solved", "has_special_form", ("lib/study/analysis/floquet.c", "lib/study/compare/dae")),
    ("spread", "expand_basis", ("lib/files/robot/sdf_tree.c", "lib/motion/batch/lanes.c", "lib/study/compare/", "include/kinetree/study.h", "apps/")),
    ("passed", "delayed", ("lib/motion/integrator/step.c",)),
    ("go", "line_search", ("apps/kinetree/sweep/ranks.c",)),
    ("go_down", "backward_pass", ()),
    ("give_way", "damped_step", ()),
    ("gives_way", "is_compliant", ()),
    ("push_velocities", "project_velocities", ()),
    ("beside", "near, next to", ()),
]
TEXT = [
    (r"compare[-_]sets", "--formulations", ("apps/kinetree/text/arguments.c", "test/command/accuracy_formulations.c")),
    (r"does not get on", "makes no progress", ("include/pages/code-style.md",)),
    (r"callback cannot tell", "cannot compute", ()),
    (r"cannot be had", "cannot be computed", ("include/pages/code-style.md",)),
    (r"is told in", "is described in", ()),
    (r"\btold (?:from|about)\b", "expressed about, in", ("include/pages/code-style.md",)),
    (r"\bgives? way", "is compliant; damped step", ("include/pages/code-style.md",)),
    (r"\b[Bb]eside\b", "next to, neighbouring, compared with", ("include/pages/code-style.md",)),
    (r"\bat one go\b", "at once", ()),
    (r"\bway[ _](?:out|back)\b", "forward pass, backward pass", ("include/pages/code-style.md",)),
    (r"\bbearers?\b", "force frame", ("include/pages/code-style.md",)),
    (r"\bcannot tell\b", "cannot compute, does not know", ()),
    (r"open links?\b", "active link", ("include/pages/code-style.md",)),
    (r"KT_BY_LEVEL|model->level", "isa", ()),
    (r"KT_REQUIRE\b", "KT_IS_MISSING", ()),
]


def code_of(text):
    """Without comments and texts, lines kept."""
    def blank(found):
        return re.sub(r"[^\n]", " ", found[0])
    return re.sub(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', blank, text, flags=re.S)


def problems(root, paths, words, read):
    for path in paths:
        name = path.relative_to(root).as_posix()
        text = read(path.read_text())
        for literal, pattern, instead, elsewhere in words:
            if literal not in text or (elsewhere and name.startswith(elsewhere)):
                continue
            for found in pattern.finditer(text):
                yield f"{name}:{text.count(chr(10), 0, found.start()) + 1}: {found[0]}: {instead}"


def main():
    root = pathlib.Path(sys.argv[1])
    sources = sorted(path for folder in ("lib", "include", "apps") for path in (root / folder).rglob("*")
                     if path.suffix in (".c", ".h"))
    pages = [root / "README.md", *sorted((root / "include/pages").glob("*.md")), *sorted((root / "apps/scenes").glob("*.yaml"))]
    note(f"{len(sources)} sources, {len(pages)} pages and scenes")
    code = [(word, re.compile(rf"(?<![A-Za-z0-9]){word}(?![A-Za-z0-9])"), *rest) for word, *rest in CODE]
    text = [("", re.compile(pattern), *rest) for pattern, *rest in TEXT]
    claim("there_are_sources", [] if len(sources) > 500 else [f"{len(sources)}"])
    claim("names_are_the_fields", list(problems(root, sources, code, code_of)))
    claim("messages_comments_and_pages_speak_as_the_field_does",
          list(problems(root, [*sources, *pages], text, lambda text: text)))
    made = "kt_status look_at(int few_rows); /* few */\n"
    found = [word for word, pattern, *_ in code if pattern.search(code_of(made))]
    claim("a_word_that_is_no_term_is_found", [] if len(found) == 2 else [f"{len(found)} of 2"])
    finish()


main()
