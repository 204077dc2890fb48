"""Measures the English of all that a person reads, and holds the bounds of the table BOUNDS.

prose.py SOURCE-ROOT            the claims, as suite `house` runs them
prose.py SOURCE-ROOT --worst N  the N worst sentences of each kind of text, with file and line
prose.py SOURCE-ROOT --files    the share of clean sentences of each file, the worst first

Four kinds of text are measured: the README and the pages, comments of public headers, comments of lib and apps, and
texts that the command and the library print. A printed text is a string literal of lib or apps/kinetree. Pages of
concepts, as kinetree.md lists them, must explain, too: so many of their sentences have a word of reason.

A sentence has four words or more. It is clean if it has none of these faults: more than 25 words; more than two numbers; an
opening such as "What" or "Of"; a clause with "what"; a verb that makes a program speak. Questions may use "what".
Code, headings, tables, formulas and addresses are left out.

No file and no sentence is exempt.
"""
# SPDX-License-Identifier: Apache-2.0
import dataclasses
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

MOST_WORDS, MOST_NUMBERS, LEAST_WORDS = 25, 2, 4

FAULTS = ("long", "numbers", "opening", "what", "speaks")
LEAST = ("clean", "reason")
# kind: per cent of clean sentences, and of sentences with a word of reason, at least; long, numbers, opening, what at most
BOUNDS = {
    "pages": {"clean": 85.0, "long": 12.0, "numbers": 1.0, "opening": 0.5, "what": 1.0},
    "concepts": {"clean": 85.0, "reason": 9.0},
    "headers": {"clean": 90.0, "long": 8.0, "numbers": 1.0, "opening": 0.5, "what": 1.0},
    "comments": {"clean": 90.0, "long": 8.0, "numbers": 1.0, "opening": 0.5, "what": 1.0},
    "messages": {"clean": 90.0, "long": 5.0, "numbers": 2.0, "opening": 0.5, "what": 1.0},
}

WORD = re.compile(r"[A-Za-z][A-Za-z'-]*")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)", re.I)
OPENING = re.compile(r"(?:What|Whatever|Whoever|Whose|Where|Of|By)\b")
WHAT = re.compile(r"\bwhat(?:ever)?\b", re.I)
SPEAKS = re.compile(r"\b(?:tells?|told|says?|said|asks?|asked|knows?|known|bears?|borne|stands?|stood|looks? at|looked at)\b", re.I)
REASON = re.compile(r"\b(?:because|so that|therefore|since)\b", re.I)
END = re.compile(r"[.!?](?=[\s)\"']+[A-Z(\"'`]|$)")
SHORT_FORM = re.compile(r"\b(?:al|approx|cf|Ch|Dr|e\.g|Eq|etc|Fig|i\.e|No|pp|resp|Sec|Vol|vs)\.$")


@dataclasses.dataclass
class Sentence:
    place: str
    text: str
    words: int

    def faults(self):
        is_question = self.text.endswith("?")
        found = {
            "long": self.words > MOST_WORDS,
            "numbers": len(NUMBER.findall(self.text)) > MOST_NUMBERS,
            "opening": not is_question and OPENING.match(self.text) is not None,
            "what": not is_question and WHAT.search(self.text) is not None,
            "speaks": SPEAKS.search(self.text) is not None,
        }
        return [name for name in FAULTS if found[name]]


# ---- paragraphs: (line, text) -----------------------------------------------------------------------------------------


class Paragraphs:
    """Joins lines to paragraphs."""

    def __init__(self):
        self.done, self.lines, self.start = [], [], 0

    def add(self, number, line):
        if not self.lines:
            self.start = number
        self.lines.append(line)

    def end(self):
        if self.lines:
            self.done.append((self.start, " ".join(self.lines)))
        self.lines = []


def paragraphs_of_page(text):
    """Paragraphs and list items of Markdown. Formulas in lines of their own ($$) end one; those within a line are a word."""
    made, is_code = Paragraphs(), False
    for number, line in enumerate(text.split("\n"), 1):
        words = re.sub(r"\$[^$]+\$", "formula", line.strip())
        if words[:3] in ("```", "~~~") or words == "$$":
            is_code = not is_code
            made.end()
        elif is_code:
            continue
        elif words == "" or words.startswith(("#", "|", "<", "![", ":", "+--", "@", "\\")) or (
                line.startswith("    ") and not made.lines):
            made.end()
        elif re.fullmatch(r"([=\-~^\"'#*+`.:_])\1{2,}", words):
            made.lines = []  # the line under a heading
        else:
            item = re.match(r"(?:[-*+]|\d+[.)])\s+", words)
            if item:
                made.end()
                words = words[item.end():]
            made.add(number, words)
    made.end()
    return made.done


COMMENT = re.compile(r"/\*(?P<block>.*?)\*/|(?P<lines>(?:^[ \t]*//[^\n]*\n)+)", re.S | re.M)


def is_formula(line):
    has_equation = re.search(r"[=^]\s|\s[=+*/]\s.*=", line)
    return has_equation and not re.search(r"[a-z]{3,} [a-z]{2,} [a-z]{2,}", line)


def paragraphs_of_comments(text):
    """Paragraphs of comments of C; formulas, rulers and short tags end one."""
    made = Paragraphs()
    for comment in COMMENT.finditer(text):
        inner = comment["block"] if comment["block"] is not None else re.sub(r"(?m)^[ \t]*//+", "", comment["lines"])
        for number, line in enumerate(inner.split("\n"), text.count("\n", 0, comment.start()) + 1):
            words = re.sub(r"^[ \t]*[*!]*<?", "", line).strip()
            if words == "" or is_formula(words) or re.match(r"[-=*]{3,}", words) or (
                    words[0] in "@\\|" and len(words) < 40):
                made.end()
            else:
                made.add(number, words)
        made.end()
    return made.done


TOKEN = re.compile(r"/\*.*?\*/|//[^\n]*|'(?:\\.|[^'\\\n])+'|(?P<text>\"(?:\\.|[^\"\\\n])*\")|(?P<gap>\s+|\bPRI\w+)|(?P<other>.)", re.S)
CONVERSION = re.compile(r"%[-+ #0]*(?:\d+|\*)?(?:\.(?:\d+|\*))?(?:hh|h|ll|l|z|j|t)?[A-Za-z]")


def paragraphs_of_texts(text):
    """Printed texts: string literals of C, adjacent ones joined. Indented lines are code, as in Markdown, and a conversion
    of printf is a word."""
    made, literal, start, line = Paragraphs(), "", 0, 1

    def finish_literal():
        nonlocal literal
        words = literal.replace(r"\"", '"').replace(r"\t", " ").replace("%%", "%")
        for number, printed in enumerate(words.split(r"\n")):
            if printed.strip() == "" or printed.startswith(("  ", "|", "#")) or is_formula(printed):
                made.end()
            else:
                made.add(start, CONVERSION.sub("code", printed))
        made.end()
        literal = ""

    for token in TOKEN.finditer(text):
        if token["text"]:
            if not literal:
                start = line
            literal += token["text"][1:-1]
        elif token["other"] and literal:
            finish_literal()
        line += token[0].count("\n")
    return made.done


# ---- sentences --------------------------------------------------------------------------------------------------------

MARKS = (
    (re.compile(r"``?[^`]*``?"), "code"),
    (re.compile(r"!?\[([^\]]*)\]\([^)]*\)"), r"\1"),
    (re.compile(r"https?://\S+"), "link"),
    (re.compile(r"<[^>]+>"), ""),
    (re.compile(r"\$[^$]*\$"), "formula"),
    (re.compile(r"[*_]{1,3}(\w[^*_]*)[*_]{1,3}"), r"\1"),
    (re.compile(r"\s+"), " "),
)


def sentences_of(path, paragraphs):
    for line, text in paragraphs:
        for pattern, instead in MARKS:
            text = pattern.sub(instead, text)
        start = 0
        for end in [*(found.end() for found in END.finditer(text)), len(text)]:
            piece = text[start:end].strip()
            if end < len(text) and SHORT_FORM.search(text[start:end]):
                continue
            start = end
            words = len(WORD.findall(piece))
            if words >= LEAST_WORDS:
                yield Sentence(f"{path}:{line}", piece, words)


def texts_of(root):
    def files(*folders):
        return sorted(path for folder in folders for path in (root / folder).rglob("*.[ch]"))
    pages = [root / "README.md", *sorted((root / "include/pages").glob("*.md"))]
    first = (root / "include/pages/kinetree.md").read_text(encoding="utf8")
    listed = re.findall(r"\]\(([\w-]+\.md)", first[first.index("## Concepts"):first.index("## Reference")])
    concepts = [root / "include/pages" / name for name in sorted({*listed} - {"bibliography.md"})]  # which has no sentences of its own
    kinds = {
        "concepts": (concepts, paragraphs_of_page),
        "pages": (pages, paragraphs_of_page),
        "headers": (files("include/kinetree"), paragraphs_of_comments),
        "comments": (files("lib", "apps"), paragraphs_of_comments),
        "messages": (files("lib", "apps/kinetree"), paragraphs_of_texts),
    }
    for kind, (paths, paragraphs) in kinds.items():
        yield kind, [sentence for path in paths
                     for sentence in sentences_of(path.relative_to(root).as_posix(), paragraphs(path.read_text(encoding="utf8")))]


# ---- figures ----------------------------------------------------------------------------------------------------------


def figures_of(sentences):
    found = [sentence.faults() for sentence in sentences]
    if not found:
        return {}
    share = {name: 100.0 * sum(name in faults for faults in found) / len(found) for name in FAULTS}
    reasons = sum(REASON.search(sentence.text) is not None for sentence in sentences)
    return {"clean": 100.0 * found.count([]) / len(found), "reason": 100.0 * reasons / len(found), **share}


def is_within(figure, observed, bound):
    return observed >= bound if figure in LEAST else observed <= bound


def hold(kind, sentences):
    figures, problems = figures_of(sentences), []
    note(f"a word of reason: {figures['reason']:.2f} %")
    for figure, bound in BOUNDS[kind].items():
        line = f"{figure}: {figures[figure]:.2f} %, bound {bound:g} %"
        note(line)
        if not is_within(figure, figures[figure], bound):
            problems.append(f"{line}; `prose.py SOURCE-ROOT --worst 20` shows sentences to rewrite")
    return problems


def show_worst(sentences, count):
    for sentence in sorted(sentences, key=lambda one: (len(one.faults()), one.words), reverse=True)[:count]:
        print(f"{sentence.place}: {sentence.words} words, {', '.join(sentence.faults())}\n    {sentence.text}")


def show_files(sentences):
    files = {}
    for sentence in sentences:
        files.setdefault(sentence.place.rsplit(":", 1)[0], []).append(sentence)
    for path, own in sorted(files.items(), key=lambda item: figures_of(item[1])["clean"]):
        print(f"{figures_of(own)['clean']:6.1f} % of {len(own):4}: {path}")


# One of each fault, in each form of text, and the same words where they are no prose.
PAGE = "# What it is\n\nWhat it is comes first. The run tells\nits steps 1, 2 and 3.\n\n| what a table says |\n\n```\nwhat code says it says\n```\n"
SOURCE = ("/* Of two bodies the first moves. Of which one? */\n// what is said here\n"
          'say("%s: " // the words that follow\n    "what %d bodies say", \'"\');\nputs("  kinetree run what it says\\n"\n"One line\\n"\n"and more.\\n");\n')


def hold_samples():
    found = [(one.text, one.faults()) for reader, text in ((paragraphs_of_page, PAGE), (paragraphs_of_comments, SOURCE), (paragraphs_of_texts, SOURCE))
             for one in sentences_of("", reader(text))]
    expected = [("What it is comes first.", ["opening", "what"]), ("The run tells its steps 1, 2 and 3.", ["numbers", "speaks"]),
                ("Of two bodies the first moves.", ["opening"]), ("what is said here", ["what", "speaks"]),
                ("code: what code bodies say", ["what", "speaks"]), ("One line and more.", [])]
    reasons = figures_of([Sentence("", text, 4) for text in ("The step ends, since the force jumps.", "The step ends there.")])["reason"]
    claim("words_of_reason_are_counted", [] if reasons == 50.0 else [f"{reasons} %"])
    long = Sentence("", "word " * (MOST_WORDS + 1), MOST_WORDS + 1)
    claim("faults_are_found_in_pages_comments_and_texts", [f"{one}" for one in found + expected if one not in found or one not in expected])
    claim("a_sentence_is_long_above_the_bound", [] if long.faults() == ["long"] and Sentence("", "", MOST_WORDS).faults() == [] else [str(long)])


def main():
    root = pathlib.Path(sys.argv[1])
    for kind, sentences in texts_of(root):
        if "--worst" in sys.argv:
            show_worst(sentences, int(sys.argv[sys.argv.index("--worst") + 1]))
        elif "--files" in sys.argv:
            show_files(sentences)
        else:
            note(f"{kind}: {len(sentences)} sentences")
            claim(f"{kind}_have_text", [] if len(sentences) > (300 if kind == "concepts" else 1000) else [f"{len(sentences)} sentences"])
            claim(f"{kind}_are_plain_english", hold(kind, sentences))
    if len(sys.argv) == 2:
        hold_samples()
        finish()


main()
