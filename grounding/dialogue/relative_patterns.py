"""Define wordings of relative changes as patterns over a sentence normalized by
`grounding.dialogue.relative_edits`.
"""

from __future__ import annotations

from grounding.lazy_pattern import LazyPattern

_IT = r"(?:it|them|all of (?:it|them)|that|this|these|those|everything|(?:the|that) (?:\w+ )?\w+)"
_BIT = (
    r"(?:(?:just )?(?:a )?(?:(?:little|tiny|wee|small|good) )?(?:bit|touch|tad|little|smidgen"
    r"|notch|fraction|nudge|step)"
    r"|slightly|somewhat|one step)"
)
_MUCH = r"(?:much|way|a lot|lots|far|considerably|a good deal|a great deal|significantly)"
_MORE = rf"(?:{_MUCH} |even |still |{_BIT} )?(?:more|further|farther)(?: over)?"
_SOME = rf"(?:{_MORE}|{_BIT}|nudge {_IT}|scoot {_IT}|inch {_IT}|edge {_IT}|closer|nearer)"
_TO = r"(?:to(?:wards?)? |on |at |in )?(?:the |my |your )?"
_LEFT, _RIGHT = r"left(?:wards?|[ -]hand side)?", r"right(?:wards?|[ -]hand side)?"
_BACK = r"(?:back(?:wards?)?|rear|away(?: from (?:me|us|you|the robot|here))?|far (?:side|end|edge))"
_FRONT = r"(?:front|forwards?|near (?:side|end|edge))"
_ME = r"(?:me|us|you|myself|the robot|the arm|here|my side|your side)"
_LARGE = (
    r"(?:big|large|wide|long|broad|spread[ -]out|far apart|loose|roomy|spacious|huge|far from each other)"
)
_SMALL = (
    r"(?:small|tight|narrow|short|compact|cramped|dense|close together|crowded|tiny|near each other|packed)"
)
_LARGER = (
    r"(?:bigger|larger|wider|longer|broader|roomier|looser|airier|huger"
    r"|more (?:spread out|spacious|spaced out|roomy|loose|loosely|space|room|air|distance|elbow room|widely)"
    r"|(?:further|farther|more) apart|more (?:distant|far) from each other"
    r"|(?:one|a|next) size (?:step )?(?:up|larger|bigger)|one step (?:up in size|larger|bigger))"
)
_SMALLER = (
    r"(?:smaller|tighter|narrower|shorter|denser|snugger|compacter|tinier|more (?:compact|tightly"
    r"|tight|dense|densely)"
    r"|(?:closer|nearer)(?: in)? (?:together|to each other|to one another|up)|less (?:space|room"
    r"|distance|air)|(?:one|a|next) size (?:step )?(?:down|smaller)|one step (?:down in size|smaller))"
)
_SLOT_WORDS = {
    "size": r"(?:size|spacing|spread|radius|length|width)",
    "position": r"(?:position|place|location|side|placement|where (?:it|they) (?:is|are|goes|go|stands?))",
    "rotation": r"(?:rotation|orientation|direction|facing|heading|turn|turning|rotating"
    r"|which way (?:it|they) faces?)",
}
_FORGET = (
    r"(?:forget|forget about|drop|never mind|ignore|remove|clear|reset|skip|without|no|any"
    r"|whatever|unset|no particular"
    r"|no special|no specific|no fixed|don't care about|do not care about|don't mind|leave open"
    r"|leave out|not any)"
)
_OPEN = (
    r"(?:doesn't matter|does not matter|is up to you|is irrelevant|is not important|isn't important"
    r"|is your choice)"
)

# (pattern, slot, how, by); earlier ones take their words away from later ones.
PATTERNS: list[tuple[LazyPattern, str, str, int | None]] = [
    (LazyPattern(rf"\b(?:{pattern})(?![\w'])"), slot, how, by)
    for pattern, slot, how, by in (
        # what is to be left open
        *(
            (rf"{_FORGET} (?:the |its |their )?{words}", slot, "clear", 0)
            for slot, words in _SLOT_WORDS.items()
        ),
        *(
            (rf"(?:the |its )?{words} {_OPEN}|leave (?:the |its )?{words} open", slot, "clear", 0)
            for slot, words in _SLOT_WORDS.items()
        ),
        (r"(?:don't|do not) (?:rotate|turn)(?: it| them)?", "rotation", "clear", 0),
        (
            r"(?:don't care|do not care|don't mind|no matter"
            r"|doesn't matter)(?: about)? (?:which way|what direction)"
            r"(?: (?:it|they|that) \w+)?",
            "rotation",
            "clear",
            0,
        ),
        (r"(?:whichever|any) way(?: (?:it|they|you) \w+)?", "rotation", "clear", 0),
        *(
            (rf"not (?:on|to|at|in) (?:the |my |your )?{words}", slot, "not", place)
            for words, slot, place in (
                ("left(?: side)?", "x_position", 0),
                ("right(?: side)?", "x_position", 2),
                ("(?:back|rear)", "y_position", 0),
                ("front", "y_position", 2),
                ("cent(?:er|re)", "x_position", 1),
            )
        ),
        (r"not (?:facing|looking|pointing|turned)(?: \w+){0,3}", "rotation", "clear", 0),
        (
            r"(?:don't care|do not care|don't mind|no matter"
            r"|doesn't matter)(?: about)? where(?: (?:it|they|that) \w+)?",
            "position",
            "clear",
            0,
        ),
        (
            r"(?:anywhere|wherever)(?! (?:on|in|at|along|near|but|else|to|except|close))(?: (?:is"
            r"|you|it|they)"
            r"(?: (?:is|are|fine|ok|okay|good|like|want|please|fits?))?)?(?: fine)?",
            "position",
            "clear",
            0,
        ),
        (
            r"(?:don't care|do not care|don't mind|no matter"
            r"|doesn't matter)(?: about)? how (?:big|large|wide|long|small)"
            r"(?: (?:it|they|that) (?:is|are))?",
            "size",
            "clear",
            0,
        ),
        # turning
        (r"(?:the )?other way (?:a)?round", "rotation", "flip", 0),
        (
            r"(?:fac(?:e|es|ing)|look(?:s|ing)?|point(?:s|ing)?|turn(?:ed|ing)?|open(?:s|ing)?"
            r"|rotated?|head(?:ed|ing)?)"
            rf"(?: {_IT})?(?: to| in| into)? (?:the )?(?:other|opposite) (?:way|direction)",
            "rotation",
            "flip",
            0,
        ),
        (r"(?:in )?(?:the )?opposite direction", "rotation", "flip", 0),
        (
            rf"(?:turn|spin|flip|rotate|swing|swivel) (?:{_IT} )?(?:a?round|about)(?! (?:a|by|one"
            rf"|half|90|180)\b)",
            "rotation",
            "flip",
            0,
        ),
        (rf"flip {_IT}(?! \w)", "rotation", "flip", 0),
        (r"back to front", "rotation", "flip", 0),
        (rf"reverse {_IT}", "rotation", "flip", 0),
        (r"(?:the )?(?:other|opposite) way", "rotation", "flip", 0),
        (
            r"(?:somewhere|someplace) else|elsewhere|(?:a|some) (?:different|other) (?:place|spot|position)",
            "elsewhere",
            "ask",
            0,
        ),
        (r"(?:taller|higher|lower|flatter)", "height", "ask", 0),
        (
            rf"(?:twice|double|three times) (?:as |the |its )?(?:{_LARGE}|size|spacing|length)(?: again)?",
            "size",
            "step",
            1,
        ),
        (rf"half (?:as |the |its )?(?:{_LARGE}|size|spacing|length)(?: again)?", "size", "step", -1),
        # too much of something, which asks for less
        (
            rf"(?:not (?:so|as|quite so|that|quite as)|less|(?:much |way |far |a bit "
            rf"|a little )?too) {_LARGE}",
            "size",
            "step",
            -1,
        ),
        (
            rf"(?:not (?:so|as|quite so|that|quite as)|less|(?:much |way |far |a bit "
            rf"|a little )?too) {_SMALL}",
            "size",
            "step",
            1,
        ),
        (rf"(?:not (?:so|as|quite so|that)|less|too)(?: far| much)? {_TO}{_LEFT}", "x_position", "step", 1),
        (rf"(?:not (?:so|as|quite so|that)|less|too)(?: far| much)? {_TO}{_RIGHT}", "x_position", "step", -1),
        (
            rf"(?:not (?:so|as|quite so|that)|less|too)(?: far| much)? {_TO}(?:back|away"
            rf"|off)(?: from {_ME})?",
            "y_position",
            "step",
            1,
        ),
        (rf"(?:not (?:so|as|quite so|that)|less|too) far(?: from {_ME})?", "y_position", "step", 1),
        (
            rf"(?:not (?:so|as|quite so|that)|less|too) (?:close|near)(?: to)?(?: {_ME})?",
            "y_position",
            "step",
            -1,
        ),
        (
            rf"(?:not (?:so|as|quite so|that)|less|too)(?: far| much)? {_TO}(?:front|forwards?)",
            "y_position",
            "step",
            -1,
        ),
        # larger and smaller
        (rf"(?:{_MUCH}|as \w+ as|all) {_LARGER}", "size", "most", 1),
        (rf"(?:{_MUCH}) {_SMALLER}", "size", "most", -1),
        (
            r"(?:as (?:big|large|wide|long|far apart|spread out) as (?:possible|you can|it gets)"
            r"|the (?:biggest|largest))",
            "size",
            "most",
            1,
        ),
        (
            r"(?:as (?:small|tight|compact|short|close together) as (?:possible|you can|it gets)"
            r"|the (?:smallest|tightest))",
            "size",
            "most",
            -1,
        ),
        (rf"(?:{_BIT} |even |still |some )?{_LARGER}", "size", "step", 1),
        (rf"(?:{_BIT} |even |still |some )?{_SMALLER}", "size", "step", -1),
        (
            rf"(?:(?:spread|space|fan|stretch|move|pull|push)(?: {_IT})? (?:out|apart)|take(?: {_IT})? apart)"
            rf"(?: {_MUCH}| {_BIT}| more| some| further| farther| wider)*",
            "size",
            "step",
            1,
        ),
        (r"(?:enlarge|expand|widen|stretch|grow|lengthen|loosen|inflate)(?! out)", "size", "step", 1),
        (r"(?:shrink|tighten|compress|condense|shorten|narrow|contract|squash|squeeze)", "size", "step", -1),
        (
            rf"(?:bring|move|push|pull|draw|put)(?: {_IT})? (?:closer |nearer )?together(?: {_BIT}"
            rf"| more| some)*",
            "size",
            "step",
            -1,
        ),
        # the other side
        (r"(?:the |its )?(?:other|opposite)(?:[ -]hand)? side", "side", "flip", 0),
        (r"(?:switch|swap|change) (?:the )?sides", "side", "flip", 0),
        (r"(?:the |its )?(?:other|opposite) end", "end", "flip", 0),
        (r"(?:the |its )?(?:other|opposite) corner", "corner", "flip", 0),
        # along the table
        (
            rf"all the way {_TO}{_LEFT}|(?:as )?far(?:thest|ther)? {_TO}{_LEFT} as (?:possible"
            rf"|you can|it goes)",
            "x_position",
            "most",
            -1,
        ),
        (
            rf"all the way {_TO}{_RIGHT}|(?:as )?far(?:thest|ther)? {_TO}{_RIGHT} as (?:possible"
            rf"|you can|it goes)",
            "x_position",
            "most",
            1,
        ),
        (rf"(?:{_MUCH} (?:more|further|farther|closer|nearer)|a lot) {_TO}{_LEFT}", "x_position", "most", -1),
        (rf"(?:{_MUCH} (?:more|further|farther|closer|nearer)|a lot) {_TO}{_RIGHT}", "x_position", "most", 1),
        (rf"{_SOME} (?:over )?{_TO}{_LEFT}(?: edge| side)?", "x_position", "step", -1),
        (rf"{_SOME} (?:over )?{_TO}{_RIGHT}(?: edge| side)?", "x_position", "step", 1),
        (
            rf"(?:shift|slide|scoot|nudge|move|push)(?: {_IT})?(?: over)? {_TO}{_LEFT} (?:by )?(?:{_BIT}|some)",
            "x_position",
            "step",
            -1,
        ),
        (
            rf"(?:shift|slide|scoot|nudge|move|push)(?: {_IT})?(?: over)? {_TO}{_RIGHT} (?:by )?(?:{_BIT}|some)",
            "x_position",
            "step",
            1,
        ),
        (rf"(?:{_MORE}|{_BIT}) (?:up|upwards?)|(?:up|upwards?) {_BIT}", "y_position", "step", -1),
        (rf"(?:{_MORE}|{_BIT}) (?:down|downwards?)|(?:down|downwards?) {_BIT}", "y_position", "step", 1),
        (r"leftwards?|lefter", "x_position", "step", -1),
        (r"rightwards?|righter", "x_position", "step", 1),
        (
            rf"(?:more (?:central|centrally|centered|centred)|(?:{_MORE}|{_BIT}|closer"
            rf"|nearer) {_TO}(?:center|centre|middle))",
            "center",
            "step",
            0,
        ),
        (rf"(?:{_MUCH} (?:more|further|farther|closer|nearer)) {_TO}{_BACK}", "y_position", "most", -1),
        (
            rf"(?:{_BIT} )?(?:(?:closer|nearer) {_TO}(?:back|rear|far (?:side|end|edge)))",
            "y_position",
            "step",
            -1,
        ),
        (
            rf"(?:{_BIT} )?(?:(?:closer|nearer) {_TO}(?:front|near (?:side|end|edge)))",
            "y_position",
            "step",
            1,
        ),
        (rf"(?:{_MUCH} )(?:closer|nearer)(?: to {_ME}| here)?", "y_position", "most", 1),
        (
            rf"(?:{_BIT} |even |still )?(?:closer|nearer)(?: to"
            rf"| towards?)?(?: {_ME})?(?! (?:to|towards?|together|on|at|in)\b)",
            "y_position",
            "step",
            1,
        ),
        (rf"(?:{_BIT} |even |still )?(?:closer|nearer)(?: to| towards?)? {_ME}", "y_position", "step", 1),
        (rf"{_SOME} {_TO}{_FRONT}", "y_position", "step", 1),
        (rf"(?:{_MORE}|{_BIT}) (?:toward|towards|to) {_ME}", "y_position", "step", 1),
        (rf"(?:{_MORE}|{_BIT}) {_TO}{_BACK}", "y_position", "step", -1),
        (rf"(?:{_MORE}) (?:off|out|up|from {_ME}|deeper)|deeper", "y_position", "step", -1),
        (rf"(?:push|shift|slide|move)(?: {_IT})? back(?: {_BIT}| some)?", "y_position", "step", -1),
        (rf"(?:pull|bring|shift|slide|move)(?: {_IT})? forwards?(?: {_BIT}| some)?", "y_position", "step", 1),
        (rf"(?:{_MORE})(?! \w)", "y_position", "step", -1),
        (r"(?:farther|further)(?= ,|$)", "y_position", "step", -1),
    )
]
