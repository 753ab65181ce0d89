"""Find the parts of a correction that were not parsed: "bigger and purple", "the other side and sort them by height".

A correction may be chatty, so most unparsed words are harmless. Only those are reported that certainly ask for
something: lengths, colours of no object, words for an order or a look, single words in a list of changes, and clauses
that begin with a verb and of which no word was understood.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from grounding.dialogue.object_changes import clauses, named_in, object_change
from grounding.dialogue.relative_edits import Edit, normalized
from grounding.goal_reading.goal_words import PATTERN_WORDS
from grounding.goal_reading.reader import GoalReader
from grounding.parse_result import Parse
from grounding.references.function_words import ARRANGING, FUNCTION_WORDS, NOT_OBJECTS
from grounding.references.lexicon import COLOURS
from grounding.references.pattern_parts import (
    ALPHABETICAL,
    ALTERNATING,
    GRADED,
    MORE,
    MOST,
    NUMBER,
    ORDER_KEY,
    POSE,
    UNIT,
)
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS
from grounding.structure_words import words_of_all

NOT_UNDERSTOOD = "{} was not understood, so nothing was changed; say the correction without it"
# Units that only a correction uses: "two fingers to the left", "10 percent".
_OTHER_UNIT = r"(?:fingers?|hands?|hand ?widths?|percent|%)"
_LENGTH = re.compile(rf"\b(?:\d+(?: , \d+)?|{NUMBER}) (?:{UNIT}|{_OTHER_UNIT})(?!\w)|\b\d+ ?(?:m|in|x)\b(?! a row)")
_ARRANGED = re.compile(
    rf"\b(?:(?:sort|order|arrange|line up|rank|group)(?:ed|ing|s)?(?: (?:it|them|these|those|everything))? by \w+"
    rf"|sort(?:ed|ing)?|{ALPHABETICAL}(?: order)?|shuffled?|{ALTERNATING}|{POSE}|mirror(?:ed)?|tilt(?:ed)?"
    rf"|lean(?:ing)?|diagonal(?:ly)?|by {ORDER_KEY}"
    r"|(?:in )?\w+ colou?rs?|(?:multi)?colou?red|(?:in )?(?:a |the )?(?:different|other|reverse[d]?"
    r"|opposite|right|new|random|any) order"
    rf"|from (?:the )?(?:{MOST}|{MORE}|{GRADED}) to (?:the )?\w+"
    r"|(?:from )?(?:left to right|right to left|front to back|top to bottom|bottom to top)"
    r"|zig ?zag|wav(?:e|y)|oval|ellipse|(?:penta|hexa|octa)gon|arch|curved?|(?:letter|shape of an?) \w|[a-z] shape"
    r"|vertical(?:ly)?|horizontal(?:ly)?|lengthwise|crosswise|sideways"
    rf"|order of {ORDER_KEY}"
    rf"|(?:the )?{MOST}(?: \w+)? (?:at|on|in(?! an?\b)|first|last|to|outside|inside)(?: the)?(?: \w+)?)\b"
)
_COLOUR = re.compile(rf"\b(?:{'|'.join(sorted(COLOURS))})\b")
_ASKING = (
    rf"(?:{'|'.join(words_of_all('asking_verbs'))}"
    r"|add|include|insert|paint|colou?r|sort|mix|balance|hide|hang|fill|pour|throw|break|open|close|clean"
    r"|wash|wipe|wrap"
    r"|tie|connect|attach|glue|label|mark|draw|write|play|sing|dance|jump|dim|take|bring|remove|delete|make"
    r"|put|place|build|set|lay|keep"
    r"|point|lift|raise|lower|drop|push|pull|press|hold|touch|shake|roll|light|count|show|invert|cover|give)"
)
_BEGINS = re.compile(rf"^(?:(?:please|then|also|now|just|and|but|to|can you|could you) )*{_ASKING}\b")
_PART = re.compile(
    rf",? *\b(?:and|but|then|or)\b(?= (?:then |also |please |now |just )*{_ASKING}\b)|,(?= *{_ASKING}\b)"
)
_LISTED = re.compile(
    r"(?:^|\b(?:and|but)|,) (?:(?:also|more|very|a bit|really|all|it|be|make it) )*([a-z']+)(?= (?:and|but|,)| ?$)"
)


def unread_words(
    text: str, edits: Sequence[Edit], parse: Parse | None, harmless: Collection[str], absolute: re.Pattern[str]
) -> tuple[str, ...]:
    """Find the parts of a correction that ask for something and were not parsed, in its order.

    Args:
        text: the correction.
        edits: its relative changes.
        parse: what the parser read of the rest, if it was asked.
        harmless: words that ask for nothing.
        absolute: finds the words for values of slots.
    """
    sentence = " , ".join(map(normalized, clauses(text)))
    objects = [clause[slice(*m.span)] for clause in clauses(text) for m in named_in(clause)]
    named = set(normalized(" ".join(objects)).split())
    known = {word for edit in edits for word in edit.words.split()} | named | set(harmless) | _CHATTER
    evidence = [" ".join(words) for words in parse.evidence.values()] if parse else []
    known |= set(normalized(" ".join(evidence)).split())
    found = [match.group() for match in (*_LENGTH.finditer(sentence), *_ARRANGED.finditer(sentence))]
    found += [match.group() for match in _COLOUR.finditer(sentence) if match.group() not in named]
    found += [word for word in sentence.split() if word.isdecimal() and word not in known]
    found += [word for word in _strange_words(text) if word not in known and not absolute.search(word)]
    if edits or parse is not None:
        found += [
            match.group(1)
            for match in _LISTED.finditer(sentence)
            if match.group(1) not in known and not absolute.search(match.group(1))
        ]
    for clause in (part for clause in clauses(text) for part in _PART.split(clause)):
        said = normalized(clause)
        read = any(edit.words in said for edit in edits) or absolute.search(said) or object_change(clause)
        if not read and _BEGINS.search(said) and (words := [word for word in said.split() if word not in known]):
            found.append(said if len(words) > 1 else words[0])
    kept = [part for part in dict.fromkeys(found) if not any(part != other and part in other for other in found)]
    return tuple(sorted(kept, key=sentence.find))


# Why something is wished asks for nothing: "smaller so that my son can reach it", "the camera cannot see it: smaller".
_REASON = re.compile(
    r"^[^:]*\b(?:cannot|can't|doesn't|does not|is|are|was|looks?|has|have)\b[^:]*:"
    r"|[ ,]+(?:so that|so|because|since|cause|otherwise|or else) (?:my|i|we|he|she|you|they|the kids|it|there)\b.*$",
    re.IGNORECASE | re.DOTALL,
)


def _strange_words(text: str) -> list[str]:
    """Return the words that no phrase of English about objects or people accounts for: "bigger flurb"."""
    found: list[str] = []
    for chunk in GoalReader().chunks(_REASON.sub("", text), Vocabulary(FORMS)):
        mention = chunk.value.mention if chunk.kind == "noun phrase" else None
        if chunk.kind == "unknown" or (mention is not None and not mention.known):
            found += [word for word in normalized(chunk.said).split() if word not in _GRAMMAR]
    return found


_GRAMMAR = FUNCTION_WORDS | PATTERN_WORDS | NOT_OBJECTS | frozenset(ARRANGING) | frozenset(
    "change fewer than add include insert remove drop lose ditch delete exclude omit skip kick scrap replace exchange "
    "substitute".split()
)
_CHATTER = frozenset(
    "substitute substituted substituting lovely perfect cool awesome great good nice fine excellent super "
    "wonderful brilliant alright right correct exactly thanks cheers ta please pls plz kindly sir buddy pal "
    "mate friend honey hello hi hey there ok okay yep yup yeah nah hmm uh um er erm ah oh wow well look see "
    "anyway though actually honestly basically seriously think guess suppose believe understand prefer rather "
    "better best worse pretty quite almost nearly close enough done again instead then now today tonight later "
    "first finally lastly more less too both else ever yet already also same again still like neat neater "
    "neatly tidy tidily clearly obviously simply careful carefully gently slowly quickly".split()
)
