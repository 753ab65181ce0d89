"""Find the words that change what others mean: corrections, exceptions, negations, sequence, and what stays in place."""

from __future__ import annotations

import re

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.ellipsis import OPPOSITES
from grounding.goal_reading.goal_words import SHAPE_NOUNS
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.tokens import Words

_CORRECTION = re.compile(
    r"(?:(?:,|\.|!|oh|er|erm|um|uh|ah|hmm) )*(?:no wait|wait no|no sorry|sorry no|no|nope|wait|sorry|oops|whoops|scratch that|scrap that|strike that|correction|i mean|i meant|i meant to say|actually"
    r"|or rather|no rather|make that|on second thought|on second thoughts|hold on|hang on|my mistake|my bad|pardon me|forget that|cancel that|or better|or actually|or no|but no|change of plan|let me correct that)"
    r"(?:(?: ,| :| \.| !| and| but)? (?:no|wait|sorry|actually|i mean|i meant|rather|oops|make that|scratch that|better|not that|that was wrong|that's wrong|of course|hold on|it should be|do|please))*(?: ,| :| \.| !)?"
)
_REVERSED = re.compile(
    r"(?:(?:but|do it|it's|exactly|just) )*(?:the )?(?:(?:other|opposite) way(?: a?round)?|vice versa|reverse)(?= [.,;!?]|$)"
)
_NOT = re.compile(r"(?:,? ?(?:and|but) )?(?:not|rather than|instead of|and not|no longer)(?= )")
_EXCEPT = re.compile(
    r"(?:, )?(?:except for|except|but not with|but not|and not|apart from|aside from|other than|excluding|excepting|leaving out|not counting|not including|without using|without including|not using|but without using|with the exception of|all but|save for|minus|without|but without|bar|barring|but)(?= )"
)
_NO = re.compile(r"(?:, )?(?:but |and )?(?:no|not any)(?= )")
_SAME = re.compile(
    r"(?:(?:and )?(?:do|repeat|then) )?(?:exactly |just )?(?:(?:the )?same(?: thing| again)?|likewise|similarly|ditto|so (?:should|shall|must|does|do|is|are|will|would|can|goes)|in the same way|the same way)"
    r"(?: (?:with|for|to|goes for|applies to))?(?= (?:[,.;!:]|the|my|all|both|and|on|at|in|back|front|left|right|top|bottom|far|near|behind)\b| [,.;!:]|$)"
    r"(?! the (?:same|table)\b)|(?:and )?so (?:should|do|does|must|can|is|are|goes|go|will)(?= (?:the|my|all|both)\b)"
)
_OTHER_SIDE = re.compile(
    r"(?:(?:on|to|at|over to|over on) )?(?:the|its) (?:other|opposite)(?: (?:side|hand|end)(?P<of> of)?|(?= [.,;!]|$))(?! the table\b)(?! of the table\b)"
)
_THEN = re.compile(
    r"(?:(?:,|and|\.|;) )*(?:then|after that|afterwards|afterward|once (?:that's|that is|you're|you are|it's|they're|they are|this is|that has been) (?:done|finished|ready|built|complete|in place|standing)|next|finally|lastly|after(?:ward|wards)|followed by)(?:(?: ,| please| also| just| you| can| you can)*)"
)
_NEGATED = re.compile(
    r"(?:do not|don't|dont|never|please don't|must not|mustn't|should not|shouldn't|cannot|can't|avoid|no need to|not to)(?= )"
)
_STAYS = re.compile(
    r"(?:(?:(?:(?:is|are|should be|must be) not|isn't|aren't) (?:a )?(?:part of|involved in|included in|in|needed in|needed for|needed|included|involved|used|to be (?:used|moved|touched|included|disturbed))(?: (?:it|this|that|them))?"
    r"|(?:should|must|may|can|shall|will|do|does) not (?:be )?(?:moved?|touched|shifted|used|disturbed)|(?:mustn't|shouldn't|can't|cannot|don't|doesn't) (?:be (?:moved|touched|shifted|used|disturbed)|move)"
    r"|(?:can|should|must|may|is to|are to|is|are|to) be (?:left out|left alone|skipped|ignored|omitted|excluded|forgotten|left where (?:it|they) (?:is|are))"
    r"|where (?:it|they) (?:is|are|was|were)(?: now)?|alone|untouched|in (?:its|their) place|as (?:it|they) (?:is|are)|out of (?:it|this)|be|there|(?:can|should|must|may|to) (?:stay|remain)(?: where (?:it|they) (?:is|are)| put| there| untouched)?|stays?(?: where (?:it|they) (?:is|are)| put| there| in place| untouched)?|(?:doesn't|don't|does not|do not) (?:count|belong|matter|take part|join(?: in)?|play a (?:part|role))|(?:stays?|remains?|is left|are left) (?:unchanged|unmoved|the same|as is|still|out of (?:it|this|that))|remains?(?: where (?:it|they) (?:is|are)| there| in place| untouched)?))(?= [.,;!?]| and| but|$| please)"
)

# After "the cups but the red one": something is said of that one alone.
_OF_ITS_OWN = frozenset("go goes should must can could is are stay stays belong belongs on at to in behind next has have".split())

# Another shape like the one before: "one circle of cups and one of cans", "... and another from the blocks".
_AGAIN = re.compile(
    r"(?:(?:in|into|as|to form) )?(?P<word>one|another(?: one)?|a (?:second|third)(?: one)?|the (?:other|second)(?: one)?) (?P<link>of|from|with|out of|made of|made from|made out of|using|for)(?= )"
)
_ANOTHER = re.compile(r"another(?: one)?(?= [.,;!]|$| and| on| at| in| to| near| along)")
_RANK = re.compile(r"(?:(?:comes|goes|is|being|stands|placed|put) )*(?P<rank>first|last)(?= [.,;!]|$| and)")
_ORDINAL = re.compile(r"the (?P<which>first|second|third|former|latter)(?: one| (?P<noun>[a-z]+))?(?= (?:goes|go|belongs|is|should|must|on|at|in|to|comes|being|near|behind|left|right)\b)")
_WHICH = {"first": 0, "former": 0, "second": 1, "latter": 1, "third": 2}
_SAME_LENGTH = re.compile(r"(?:(?:at|by|with|and|the|exactly|just|also) )*(?:same|that) (?:distance|gap|spacing|amount)(?: away)?|equally far(?: away)?|just as far(?: away)?")


def marks_at(said: Words, place: int, before: list[Chunk], phrases: NounPhraseReader) -> list[Chunk]:
    """Read the marks that begin at a word.

    Args:
        said: the words.
        place: of the first word.
        before: the chunks before it.
        phrases: reads the noun phrases of the instruction.
    """
    found = []
    if (match := said.match(_NO, place)) and _leaves_out(phrases, match[1], before):
        return [Chunk("except", True, place, match[1])]
    if (match := said.match(_CORRECTION, place)) and _corrects(said, match[1], match[0].group(), before):
        found.append(Chunk("correction", match[0].group(), place, match[1]))
    if (match := said.match(_SAME, place)) and before:
        found.append(Chunk("same", True, place, match[1]))
    if (match := said.match(_OTHER_SIDE, place)) and any(map(_sided, before)):
        kind = "relation" if match[0].group("of") else "relation it"
        found.append(Chunk(kind, "other side of", place, match[1]))
    if (match := said.match(_REVERSED, place)) and before and before[-1].kind == "correction":
        found.append(Chunk("reversed", True, place, match[1]))
    if match := said.match(_NEGATED, place):
        found.append(Chunk("negated", True, place, match[1]))
    if (match := said.match(_EXCEPT, place)) and _excepts(phrases, match[1], match[0].group(), before):
        found.append(Chunk("except", True, place, match[1]))
    if match := said.match(_NOT, place):
        found.append(Chunk("not", True, place, match[1]))
    if match := said.match(_THEN, place):
        found.append(Chunk("followed by" if "followed by" in match[0].group() else "then", True, place, match[1]))
    if (match := said.match(_AGAIN, place)) and _again(match[0], said, match[1], before, phrases):
        found.append(Chunk("another", True, place, match[1]))
    if before and before[-1].kind == "noun phrase":
        shaped = any(one.kind == "shape" for one in before)
        if shaped and (match := said.match(_ANOTHER, place)):
            found.append(Chunk("another", True, place, match[1]))
        if _in_line(before) and (match := said.match(_RANK, place)):
            found.append(Chunk("rank", match[0].group("rank"), place, match[1]))
    if (match := said.match(_ORDINAL, place)) and _of_structures(match[0], before):
        phrase = NounPhrase("structure", place, match[1], f"#{_WHICH[match[0].group('which')]}")
        found.append(Chunk("noun phrase", phrase, place, match[1]))
    if (match := said.match(_SAME_LENGTH, place)) and (lengths := [one.metres for one in before if one.metres is not None]):
        found.append(Chunk("same distance", True, place, match[1], lengths[-1]))
    if (match := said.match(_STAYS, place)) and before and (match[0].group() != "there" or _leaves(before)):
        found.append(Chunk("stays", True, place, match[1]))
    return found


def _leaves(before: list[Chunk]) -> bool:
    """Return whether the last verb asks to leave something: "leave it there", and not "put it on the plate there"."""
    verb = next((one for one in reversed(before) if one.kind in ("verb", "negated")), None)
    return verb is not None and (verb.value == "leave" or verb.said.lower().split()[0] in ("keep", "let", "have"))


def stays_at(said: Words, place: int) -> bool:
    """Tell whether a word begins what says that something stays where it is."""
    return said.match(_STAYS, place) is not None


def _sided(chunk: Chunk) -> bool:
    """Return whether something is placed on a side that has an opposite one."""
    if chunk.kind == "place":
        return (chunk.value.x_position is None) != (chunk.value.y_position is None)
    return chunk.kind in ("relation", "relation it") and chunk.value in OPPOSITES


def _leaves_out(phrases: NounPhraseReader, end: int, before: list[Chunk]) -> bool:
    """Return whether "no" leaves some of several objects out: "a circle of the cups, no red ones"."""
    phrase = phrases.at(end)
    if phrase is None or phrase.kind != "objects" or phrase.mention.definite or not phrase.many:
        return False
    return any(chunk.kind == "noun phrase" and chunk.value.many for chunk in before)


def _in_line(before: list[Chunk]) -> bool:
    """Return whether objects stand one after another, so that one of them can be the first."""
    return any(
        (one.kind == "shape" and one.value.name in ("line", "arc", "tower"))
        or (one.kind == "verb" and one.value in ("line", "stack"))
        for one in before
    )


def _of_structures(match: re.Match[str], before: list[Chunk]) -> bool:
    """Return whether "the first" can mean one of several structures."""
    noun = match.group("noun")
    structures = sum(one.value.count or 2 for one in before if one.kind == "shape") + sum(
        one.kind == "another" or (one.kind == "verb" and one.value in ("line", "stack", "cluster")) for one in before
    )
    return structures > 1 and (noun is None or noun in SHAPE_NOUNS)


def _again(match: re.Match[str], said: Words, end: int, before: list[Chunk], phrases: NounPhraseReader) -> bool:
    """Return whether "one of" and the like speak of a shape, and not of an object: "one of the cans" may be a can."""
    shapes = [one for one in before if one.kind == "shape"]
    if not shapes or phrases.at(end) is None:
        return False
    several = any(one.value.count > 1 for one in shapes)
    partitive = match.group("link") == "of" and said.word(end) in ("the", "my", "these", "those", "them", "your")
    return several or not partitive or match.group("word") not in ("one", "another")


def _corrects(said: Words, end: int, words: str, before: list[Chunk]) -> bool:
    """Return whether these words take something back, and are no opening and no "no gap"."""
    if not any(chunk.kind not in ("noise", "comma", "stop", "and") for chunk in before):
        return False
    if words.split()[-1] == "no" or words.strip(" ,.") == "no":
        kept = ("gap", "gaps", "space", "other", "one", "more")
        reverses = said.word(end) == "other" and said.word(end + 1) == "way"
        return words.startswith((",", ".")) and (reverses or said.word(end) not in kept)
    return words != "wait"


def _excepts(phrases: NounPhraseReader, end: int, words: str, before: list[Chunk]) -> bool:
    if phrases.at(end) is None:
        return False
    if words.strip(" ,") in ("but not", "and not", "but not with"):
        return any(chunk.kind == "noun phrase" and chunk.value.many for chunk in before)
    if words.strip(" ,") != "but":
        return True
    last = next((chunk for chunk in reversed(before) if chunk.kind != "noise"), None)
    if last is None or last.kind != "noun phrase" or not last.value.many:
        return False
    whole = last.value.kind == "all" or {"all", "every", "each", "any"} & set(last.value.text.lower().split())
    return bool(whole) or phrases.said.word(phrases.at(end).end) not in _OF_ITS_OWN
