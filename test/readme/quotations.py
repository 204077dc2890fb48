"""The messages that pages quote are those of the program: the words of a quotation, without its values, are those of texts in the sources.

    quotations.py SOURCE-ROOT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

TEXT = r'"(?:\\.|[^"\\\n])*"'
VALUE = re.compile(r"'?%[-+ #0]*[\d*]*(?:\.[\d*]+)?(?:hh|ll|[hlzjt])?[a-zA-Z]'?")
WORDS = 3  # as many words, next to each other but for values, are in one text

# Reasons for which a table of robots has no numbers; faults and warnings with their place, and the notes that follow.
REJECTED = re.compile(r"rejected: ([^|]*[^| ])")
PLACED = re.compile(r"^ {4}[\w./-]+:\d+:\d+: (?:warning: )?(.*)$", re.M)
NOTED = re.compile(r"^ {6,}note: (.*)$", re.M)
TABLES = "robot-files-"  # on other pages `rejected:` begins an explanation
CONTEXT = re.compile(r"^(?:\w+(?: '[^']*')?: )+")  # elements and attributes of the file
OF_EXPAT = ("unknown encoding",)  # values of several words


def words_of(text):
    return re.findall(r"%|\w[\w'/-]*", text.lower())


def texts_of(root):
    """Strings of the sources, in words; a value is `%`."""
    for path in sorted(path for folder in ("lib", "apps") for path in (root / folder).rglob("*.[ch]")):
        code = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
        for found in re.finditer(rf"{TEXT}(?:\s*{TEXT})*", code):
            whole = "".join(part[1:-1] for part in re.findall(TEXT, found[0])).replace('\\"', '"').replace("\\n", " ")
            yield " ".join(words_of(VALUE.sub(" % ", whole)))


def unknown_words(quotation, texts):
    """Words of a quotation that are in no text, with the words around them, nor in place of a value."""
    is_cut = quotation.endswith("...")
    text = CONTEXT.sub("", quotation.removesuffix("..."))
    for value in OF_EXPAT:
        text = text.replace(value, " % ")
    words = words_of(re.sub(r"'[^']*'|\S*://[^\s;]*|(?<!\w)[-+]?\d[\d.e+-]*", " % ", text))

    def is_there(part, is_end):
        wanted = " " + " ".join(part) + ("" if is_end and is_cut else " ")
        return any(wanted in text for text in texts)

    def is_covered(words, at):
        """Whether a part around a word, with WORDS or all of the quotation, is in a text."""
        for first in range(at, -1, -1):
            end = at + 1
            while end < len(words) and sum(word != "%" for word in words[first:end]) < WORDS:
                end += 1
            real = sum(word != "%" for word in words[first:end])
            if (real >= WORDS or (first, end) == (0, len(words))) and is_there(words[first:end], end == len(words)):
                return True
        return False

    return [word for at, word in enumerate(words)
            if word != "%" and not is_covered(words, at) and not is_covered([*words[:at], "%", *words[at + 1:]], at)]


def quotations_of(root):
    for path in [root / "README.md", *sorted((root / "include/pages").glob("*.md"))]:
        text = path.read_text()
        for kind in [PLACED, NOTED] + ([REJECTED] if path.name.startswith(TABLES) else []):
            for found in kind.finditer(text):
                yield f"{path.name}:{text.count(chr(10), 0, found.start()) + 1}", found[1]


def dead_kinds(root, texts):
    """Patterns of robots.py, which shorten messages for the tables, that no message has."""
    table = re.search(r"^KINDS = \[(.*?)\]$", (root / "test/files/robot/robots.py").read_text(), flags=re.M | re.S)[1]
    for pattern, _ in re.findall(r'\("([^"]*)", "([^"]*)"\)', table):
        for one in pattern.split("|"):
            if not any(" ".join(words_of(one)) in text for text in texts):
                yield f"no message has '{one}'"


def main():
    root = pathlib.Path(sys.argv[1])
    texts = sorted({f" {text} " for text in texts_of(root) if text})
    quotations = list(quotations_of(root))
    note(f"{len(quotations)} quotations, {len(texts)} texts")
    claim("pages_quote_messages", [] if len(quotations) > 15 and len(texts) > 5000 else ["too few"])
    claim("quotations_are_messages",
          [f"{where}: '{' '.join(unknown)}' of '{quotation}'" for where, quotation in quotations
           if (unknown := unknown_words(quotation, texts))])
    claim("a_changed_message_is_found",
          [text for text in ("parent 'crnak' is not there; did you mean 'crank'?", "class 'waist' is not there",
                             "there is no 'global'; it must be one of local")
           if not unknown_words(text, texts)])
    claim("tables_of_robots_shorten_messages", list(dead_kinds(root, texts)))
    finish()


main()
