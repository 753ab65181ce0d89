"""Recognise phrases for all that is there, "the whole lot", and for what is left of it, "the remaining ones"."""

from __future__ import annotations

import re

from grounding.goal_reading.measures import COUNTS

_PLACE = (
    r"(?:table|tabletop|desk|bench|workbench|scene|counter|kitchen|bathroom|office|workshop|garden|house|room|lab|"
    r"surface|"
    r"picture|worktop|world)"
)
# "that you can see", "on this table": what is true of everything.
HERE = (
    r"(?: (?:there (?:is|are)(?: here)?|(?:that |which )?(?:is |are |lies |lie |stands |stand )?(?:lying |standing |"
    r"sitting )?(?:on|in|at|around) "
    rf"(?:the |my |this |our |your |that )(?:whole |entire )?{_PLACE}|(?:that is |that are |is |are |lying |"
    rf"standing )?(?:right )?"
    r"(?:here|there|around|about|in here|on here|over here)|(?:that )?(?:you|i|we) (?:can )?(?:see|find|have got|"
    r"have|own|got|bought|"
    r"brought)|in front of you|provided|available|present|at hand|to hand))"
)
_WHOLE = (
    r"(?:the |this |that |my )?(?:whole|entire|complete|full) (?:(?:blooming|bloody|damn|kitchen|office|desk|"
    r"breakfast|tea|"
    r"dinner|lovely|little) )?(?:lot|collection|assortment|set|bunch|crowd|family|scene|table|gang|shebang|caboodle|"
    r"inventory)"
)
_COUNTS = "|".join(word for word in COUNTS if word not in ("a", "an"))
_ALL = re.compile(
    rf"(?:absolutely |just |simply )?(?:(?:all |the )?(?P<count>{_COUNTS}) of (?:them|these|those)|all of the above|"
    rf"everything|everybody|everyone|anything|all of (?:it|this|that|these|those|them)|it all|"
    rf"them all|these all|all these|all those|all this|all that|all them|all|{_WHOLE}(?: of (?:them|it|these|this))?|"
    rf"(?:the |all the |that )?lot(?: of (?:them|it|these|this))?|the whole of (?:this|it|them)|"
    rf"what(?:ever)?(?={HERE}+$)|"
    rf"what(?:ever)? there is|what(?:ever)?(?= (?:you|i|we) (?:can |could )?(?:see|find|have)(?: got)?$)|the bunch|"
    rf"the gang|"
    rf"(?:all |each |every ?one )of (?:them|these|those)){HERE}*(?: really| please| together| too)*(?= |$)"
)
_REST = re.compile(
    r"(?:and )?(?:everything else|all else|anything else|everybody else|everyone else|(?:all )?(?:the )?(?:rest|"
    r"remainder)|"
    r"(?:what|whatever|all|everything)(?: that)? (?:remains|is left(?: over)?|is still left|is remaining)|"
    r"every other (?:thing|item|object)|"
    r"(?:all )?(?:the )?(?:others|other ones|remaining ones|leftovers))(?: of (?:it|them|the (?:lot|scene|table|"
    r"things|objects|items|stuff)|this))?"
    rf"{HERE}*(?= |$)"
)
_PRONOUN = re.compile(r"(?:them|they|these|those|this|that|it|itself|that one|this one|the former|the latter)$")


def universal_at(words: tuple[str, ...], at: int) -> tuple[str, int] | None:
    """Read a phrase for everything or for the rest of it.

    Returns:
        "all", "rest", "others" or "pronoun", and the place after it; `None` where no such phrase stands.
    """
    said = " ".join(words[at:])
    if found := _REST.match(said):
        kind = "others" if re.search(r"others|ones", found.group()) else "rest"
        return kind, at + len(found.group().split())
    if found := _PRONOUN.match(said):
        return "pronoun", at + len(found.group().split())
    if (found := _ALL.match(said)) is not None:
        return "all", at + len(found.group().split())
    return None


def idle_place(words: tuple[str, ...], at: int) -> int:
    """Return the place after words that are true of all that is there, "on the table"; `at` where none stand."""
    found = re.match(rf"(?:{HERE})+(?= |$)", " " + " ".join(words[at:]))
    return at + len(found.group().split()) if found else at
