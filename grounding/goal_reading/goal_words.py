"""List the words that goals are said with: shapes, sides, and what says nothing of a goal."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.goal_reading.verb_words import VERBS
from grounding.structure_words import STRUCTURES


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# Shape -> nouns beyond those of its own file.
_MORE_NOUNS: Mapping[str, tuple[str, ...]] = {
    "circle": ("circle", "ring", "loop", "closed ring", "round circle", "full circle", "halo", "hoop"),
    "line": ("line", "row", "queue", "straight line", "single file", "file", "chain", "single row", "line formation", "column", "single column"),
    "tower": ("tower", "stack", "pile", "heap", "vertical stack", "pillar"),
    "table setting": ("table setting", "place setting", "setting", "dinner setting", "place for one"),
    "cluster": (
        "cluster", "clump", "group", "bunch", "huddle", "bundle", "tight group", "little group", "heap on the table", "blob",
        "flat pile", "loose pile", "gathering", "loose heap",
    ),
    "rectangle": ("rectangle", "rectangular frame", "oblong", "rectangular outline", "box shape", "rectangular shape"),
    "square": ("square", "square outline", "square shape", "square frame"),
    "triangle": ("triangle", "triangular shape", "triangular formation", "delta", "triangular outline"),
    "arc": (
        "arc", "semicircle", "semi circle", "half circle", "crescent", "curve", "half ring", "half moon", "horseshoe", "bow",
        "arch on the table", "rainbow", "open curve", "curved line", "c shape", "u shape", "half of a circle",
        "smile", "banana shape",
    ),
    "grid": ("grid", "matrix", "lattice", "checkerboard", "array", "chessboard", "raster", "grid pattern", "regular grid"),
    "cross": ("cross", "plus", "plus sign", "plus shape", "cross shape", "crosshair"),
    "pyramid": ("pyramid", "standing pyramid", "pyramid wall", "pyramid shape", "human pyramid"),
}  # fmt: skip
_SUFFIXES = ("", " shape", " formation", " pattern", " arrangement")
_VAGUE = _words("column round place group gathering thing train string order file")


def _shape_nouns() -> dict[str, str]:
    found: dict[str, str] = {}
    for shape, nouns in _MORE_NOUNS.items():
        structure = STRUCTURES.get(shape)
        more = (*structure.words.nouns, *structure.phrases.get("noun", ())) if structure else ()
        for noun in (*nouns, *more):
            said = " ".join(noun.lower().replace("-", " ").split())
            if said in _VAGUE and noun not in nouns:
                continue
            for suffix in _SUFFIXES:
                found.setdefault(said + suffix, shape)
    return found


SHAPE_NOUNS: Mapping[str, str] = _shape_nouns()
SHAPES_OF_VERB: Mapping[str, str] = {"stack": "tower", "line": "line", "cluster": "cluster", "circle": "circle"}

# Words that say nothing of what is asked for.
NOISE = _words(
    "please kindly ok okay hey hi hello yo robot thanks thank thx cheers mate buddy dear friend well so um uh er erm hmm ah oh "
    "now then just simply carefully gently slowly quickly neatly nicely properly tidily cleanly exactly precisely evenly "
    "directly immediately roughly approximately about maybe perhaps possibly kinda could can would will you u i i'd i'll i'm "
    "we we'd let's let me us want wants love should shall must to be it's that's there here do does go goes going come comes "
    "being placed standing sitting so have has a an the and or also too additionally as well finally lastly firstly secondly "
    "thirdly afterwards afterward again once done really very quite pretty rather nice lovely good great neat tidy try sure "
    "ensure mind if possible anyway somehow meanwhile darling sweetheart sir pal bot machine assistant today tonight quick "
    "favor favour help wanna gonna gotta yes yeah yep alright fine cool perfect for like my your is are i've what "
    "appreciate appreciated grateful thats sits stands sit stand gets get end ends up pls need needs that grab "
    "respectively accordingly myself yourself finished ready arm jaco instead only just belong belongs lie lies say running stretching basically honestly literally essentially next first second third then both each all of it's with from and "
    "up out down over how're ya dude bro team everyone yet still still currently already them their its it simple basic regular proper"
)
# What may stand before or after a part and says nothing: phrases, longest first.
NOISE_PHRASES = (
    "i would like you to", "i'd like you to", "i want you to", "i need you to", "could you please", "can you please", "would you please",
    "would you mind", "do you mind", "do me a favor and", "do me a favour and", "if you don't mind", "if you would", "if you can",
    "if you could", "if possible", "if it's possible", "thank you", "thanks a lot", "thank you very much", "thanks in advance",
    "many thanks", "on the table", "on the desk", "on the tabletop", "on my desk", "on my table", "on this table", "of the table",
    "on the surface", "on the work surface", "on the table top", "on the workspace", "for me", "for us", "at the same time", "as well", "when you are done",
    "when you're done", "when that's done", "once that's done", "once that is done", "after that", "after this", "and after that",
    "next up", "in the end", "at the end", "make sure that", "make sure", "be careful", "be gentle", "good morning", "good evening",
    "good afternoon", "hey there", "hi there", "go ahead and", "go ahead", "i think", "i guess", "you know", "how about",
    "what about", "let us", "i was wondering if you could", "is it possible to", "would it be possible to", "the following",
    "as follows", "like this", "like so", "one more thing", "first of all", "to begin with", "to start", "to start with",
    "that would be great", "that'd be great", "it would be great if you could", "it'd be great if you could", "when you get a chance",
    "when you have a moment", "when you have time", "in your own time", "take your time", "no rush", "as soon as possible", "asap",
    "so that it is", "so it is", "so that it's", "so it's", "such that it is", "so that they are", "so they are", "such that they are", "until it is",
    "be so kind as to", "be so kind to", "would you be so kind as to", "would you be so kind to", "be kind enough to", "i was thinking", "i was thinking that",
    "i was hoping", "i was hoping you could", "would you be able to", "are you able to", "be a dear and", "be an angel and", "it would be nice if", "it would be nice to have", "i'd be happy if",
    "i'd be glad if", "i would be grateful if you could", "i'd appreciate it if you could", "i'd appreciate it if you", "i would appreciate it if you could", "made of", "made up of", "made from", "made out of",
    "formed by", "made by", "built by", "be formed by", "created by", "be made by", "composed by", "consisting of", "out of", "composed of", "built from", "built out of", "built of", "using", "with just", "with only", "only the", "to be", "if you please", "will you", "would you", "won't you",
    "on top of that", "in addition", "in addition to that", "for starters", "before that", "so that", "such that", "in such a way that", "and that's it",
    "that's it", "that's all", "that is all", "nothing else",
    "should be", "should go", "has to be", "have to be", "needs to be", "need to be", "must be", "ought to be", "is to be",
    "are to be", "i'd love", "i would love", "i'd prefer", "i would prefer", "we should have", "there should be", "i should see",
    "with care", "very carefully", "and then", "and also", "but also", "then also", "on the other hand", "at last", "in one go",
    "one by one", "one at a time", "one after another", "one after the other", "step by step", "right now", "right away", "in turn", "all of", "in place", "into place", "where i can see it", "where i can see them",
    "that's why", "that is why", "this is why", "which is why", "by myself", "on my own", "by yourself", "by hand", "in any case", "at any rate",
    "its position", "their position", "its place", "their place", "your job is to", "your task is to", "i'm asking you to",
    "in a neat way", "in a tidy way", "nice and neat", "nice and tidy", "nice and even", "nicely and evenly", "evenly spaced", "equally spaced", "at equal distances",
    "with equal spacing", "with equal gaps", "with even gaps", "with even spacing", "spaced evenly", "spaced equally", "at regular intervals", "regularly spaced",
    "in equal distances", "equidistant", "equally apart",
)  # fmt: skip

PATTERN_WORDS = (
    NOISE
    | frozenset(VERBS)
    | _words(
        "consisting composed comprising made built formed arranged stacked lined piled total radius diameter gap gaps spacing apart rows columns height width size volume colour kind type corner edge rim border row column "
        "between around along tallest shortest biggest smallest order ascending descending increasing decreasing clockwise "
        "swap swapped wait sorry actually instead oops scratch correction mean neither nor except without but not no never "
        "side hand half third part area region zone section end wall letter word heart bridge house zigzag diagonal diagonally "
        "star spiral angle degrees upside facing pointing opening open inside within under beneath below above over underneath "
        "either clearance neighbours neighbors neighbouring separately flanking likewise another halfway midway distance len center middle left right front back rear near far top bottom north south east west"
    )
    | frozenset(word for noun in SHAPE_NOUNS for word in noun.split() if noun not in _VAGUE and " " not in noun)
)
