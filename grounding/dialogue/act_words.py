"""Define the words that questions in a conversation are made of, and the pieces that their wordings share."""

from __future__ import annotations

from collections.abc import Mapping

COLORS = (
    "red", "orange", "yellow", "green", "turquoise", "blue", "purple", "pink", "brown", "black", "white", "gray",
)  # fmt: skip
# Superlative -> the measure that it compares, and whether it means the most of it.
SUPERLATIVES: Mapping[str, tuple[str, bool]] = {
    "tallest": ("height", True), "highest": ("height", True), "shortest": ("height", False),
    "lowest": ("height", False), "flattest": ("height", False), "biggest": ("volume", True),
    "largest": ("volume", True), "smallest": ("volume", False), "widest": ("width", True), "longest": ("width", True),
    "narrowest": ("width", False), "thinnest": ("width", False), "nearest": ("distance", False),
    "closest": ("distance", False), "farthest": ("distance", True), "furthest": ("distance", True),
    "leftmost": ("left", True), "rightmost": ("left", False),
}  # fmt: skip
# Comparative -> the superlative that compares the same measure.
COMPARATIVES: Mapping[str, str] = {
    "taller": "tallest", "higher": "highest", "shorter": "shortest", "lower": "lowest", "flatter": "flattest",
    "bigger": "biggest", "larger": "largest", "smaller": "smallest", "wider": "widest", "longer": "longest",
    "narrower": "narrowest", "thinner": "thinnest", "nearer": "nearest", "closer": "closest", "farther": "farthest",
    "further": "furthest",
}  # fmt: skip
# What is said of a place by another object -> the relation, as the goals of several parts have it, or "under".
RELATIONS_SAID: Mapping[str, str] = {
    "on top of": "on", "on": "on", "inside of": "in", "inside": "in", "within": "in", "in": "in",
    "underneath": "under", "under": "under", "beneath": "under", "below": "under",
    "to the left of": "left of", "on the left of": "left of", "left of": "left of", "left from": "left of",
    "on the left side of": "left of", "to the right of": "right of", "on the right of": "right of",
    "right of": "right of", "right from": "right of", "on the right side of": "right of", "behind": "behind",
    "in front of": "in front of", "next to": "next to", "beside": "next to", "near to": "next to",
    "nearest to": "nearest", "closest to": "nearest", "near": "next to",
    "close to": "next to", "at": "on", "between": "between",
}  # fmt: skip
# What is said of a part of the table -> the part, as an object's place names it.
REGIONS: Mapping[str, str] = {
    "left": "on the left", "right": "on the right", "middle": "middle", "center": "middle", "centre": "middle",
    "front": "near you", "back": "far from you", "rear": "far from you",
}  # fmt: skip
# Words that are in no noun phrase of an object: what holds one of them asks for something else.
NO_THING = frozenset(
    "to put make build place way ways chance possibility reason problem point room space idea difference time "
    "minute question questions doubt plan name opinion stack line arrange form create set lay move pile add "
    "swap take let give get do does did can could will would should may might must shall if that which who "
    "what when than because while you i me we us he she your my mine yours need use good better possible bit "
    "more less instead and or but not so too as like into next between behind beside under over about be been "
    "being go going nothing something anyone somebody anybody else again is are was were from there any "
    "another nicer prettier".split()
)
PARTS: Mapping[str, str] = {
    "ADDRESS": "(robot|mr robot|agent|structagent|arm|computer|mate|man|buddy|friend|partner|dear|you|there|everyone"
    "|all)",
    "THING": r"(?P<about>[\w'-]+( [\w'-]+){0,8}?)",
    "OTHER": r"(?P<other>[\w'-]+( [\w'-]+){0,6}?)",
    "REL": f"(right |directly |immediately |standing |lying "
    f"|sitting )*(?P<relation>{'|'.join(sorted(RELATIONS_SAID, key=len, reverse=True))})",
    "IS": "(is|are|was|were|stands?|lies?|sits?)( (there|standing|lying|sitting|placed|located|currently))*",
    "COMPARATIVE": f"<VALUE:{'|'.join(COMPARATIVES)}>",
    "THE": r"((a|an|any|some|the|that|this|another|all|all the|your|also|still) )*",
    "OBJECTS": "(objects?|things?|items?|stuff)",
    "PLACED": "( (here|there|around|anywhere|left|at all|too|now|still|also|lying|standing|on (the|this|your) table"
    "|in front of you|in the scene|in view|you (can )?see|you have|altogether|in total|that there (is|are)))*",
    "SEE": "(see|have|got|have got|find|spot|recogni[sz]e|happen to see|happen to have|know|detect)",
    "SUPERLATIVE": f"<VALUE:{'|'.join(SUPERLATIVES)}>",
    "OF_ALL": "( (one|of (all|them|these|those|the lot|the bunch)|to you|from you|from here|to me|from me|away))*",
    "COLOR": f"({'|'.join(COLORS)})",
    "CHOOSE": "(choose|chose|chosen|pick|picked|prefer|preferred|select|selected|propose|proposed|suggest|suggested"
    "|take|took|want|decide|decided)( for| on)?",
    "THAT": "(that|this|it|the)( (one|arrangement|candidate|order|place|way|spot|position|choice|option|proposal|goal"
    "|best|first|second|third))*",
    "LATELY": "( (so far|just|just now|now|there|last|until now|here|today|before|(with|to) (it|them|that)))*",
    "SAY": "(do|say|type|write|enter|ask|tell you|ask you|ask for|ask you for|try|build|make|start with|use)",
    "BUILT": "(do|done|build|built|make|made|move|moved|change|changed)",
    "GREETING": "(hi|hiya|hello|hallo|hey|howdy|yo|greetings|good (morning|afternoon|evening|day))"
    "( (hi|hello|again|world|to you|<ADDRESS>))*",
    "THANKS": "(many )?(thanks|thank you|thankyou|thx|ty|cheers|ta|much appreciated)( (a lot|a million|again|so much"
    "|very much|for (that|this|it|everything|(the|your) help)|<ADDRESS>))*",
    "PRAISE": "((that|this|it) (is|was|looks) |you are |looks |how |i am )?((so|very|really|pretty|just|quite) )*(nice"
    "|great|good|lovely|cool|perfect|wonderful|awesome|excellent|beautiful|brilliant|amazing|fantastic|neat|impressive"
    "|impressed|super|wow)( (job|work|one|stuff))?|well done|i (like|love) (it|that|this)",
}
