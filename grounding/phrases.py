"""Phrases of free language, by slot: what people say instead of the vocabulary. Data only.

Every sixth phrase of a table is held out from the parser's measured training (see `paraphrases.py`).
"""

OPENINGS = (
    "", "", "please", "could you", "can you please", "robot,", "", "I want you to", "I'd like you to", "now",
    "", "would you", "hey robot, please", "next,", "your task is to", "", "you should", "go ahead and",
    "let's",
)  # fmt: skip
CLOSINGS = (
    "please", "thanks", "for my guests", "if you can", "right now", "carefully", "before lunch", "thank you",
    "with your arm", "as quickly as you can", "right away", "without dropping anything", "for me", "again",
    "on the table", "on this table", "and be careful", "on the tabletop",
)  # fmt: skip
DETERMINERS = (
    "the", "all the", "the", "all", "these", "those", "my", "the three", "every one of the", "the four",
    "both", "some of the", "the five", "two", "our", "all of the", "each of the", "the other",
)  # fmt: skip
# Sizes and shapes of the objects themselves are no wish about the structure.
OBJECT_ADJECTIVES = (
    "red", "blue", "white", "metal", "small", "shiny", "large", "wooden", "big", "round", "little", "green",
    "square", "tall", "plastic", "rectangular", "clean", "black", "yellow", "heavy", "long", "triangular",
)  # fmt: skip
OBJECT_NOUNS = (
    "cups", "mugs", "bowls", "plates", "cans", "bottles", "boxes", "jars", "forks", "knives", "spoons",
    "glasses", "blocks", "toys", "objects", "things", "items", "tins", "teacups", "dishes", "pans", "apples",
    "cutlery", "kitchen stuff", "lemons", "cubes", "balls", "soup cans", "cracker boxes", "silverware",
    "oranges",
    "containers", "pieces", "tools", "markers", "mustard bottles", "bananas", "pears", "sponges", "spatulas",
    "fruits", "strawberries", "bricks", "toy planes", "jugs",
)  # fmt: skip
SINGLE_NOUNS = (
    "cup", "mug", "bowl", "plate", "can", "bottle", "box", "fork", "knife", "spoon", "glass", "banana",
    "sponge",
    "apple", "pan", "tin", "spatula", "pitcher", "soup can", "teapot", "ball", "block", "lemon", "toy",
)  # fmt: skip
OBJECT_PRONOUNS = (
    "everything", "them", "them all", "it all", "all of them", "these", "everything you see",
    "everything on the table",
    "everything but the bowl", "whatever is left", "all objects except the mug", "the rest",
    "all that is left", "what is left on the table",
)  # fmt: skip
SHAPE_NOUNS = {
    "circle": (
        "circle", "ring", "circle", "circular shape", "round formation", "loop", "circular arrangement",
        "circular pattern", "round shape", "perfect circle", "circle formation", "circular formation",
    ),
    "line": (
        "line", "row", "straight line", "single row", "line", "queue", "straight row", "linear arrangement",
        "single line", "neat row", "line formation", "lineup",
    ),
    "tower": (
        "tower", "stack", "pile", "tower", "vertical stack", "single stack", "tall tower", "vertical tower",
        "vertical pile", "neat stack", "high tower", "towering stack",
    ),
    "table setting": (
        "table setting", "place setting", "dinner setting", "dining setup", "dinner table setting",
        "breakfast setting", "proper table setting", "setting for one person", "formal place setting",
        "lunch setting", "dinner arrangement", "dining arrangement",
    ),
    "other": (
        "square", "triangle", "rectangle", "heart", "star", "pyramid", "cross", "letter X", "spiral",
        "pentagon",
        "zigzag", "hexagon", "grid", "letter A", "diamond", "smiley face", "cube", "half circle", "arc",
        "L shape",
        "diagonal", "octagon", "semicircle", "trapezoid", "bridge", "house", "checkerboard", "arrow",
        "triangular shape", "heart shape", "square shape", "word", "T shape", "wall", "parallelogram",
        "matrix",
    ),
    "": (
        "structure", "arrangement", "formation", "structure", "group", "configuration", "layout", "pattern",
        "cluster", "shape", "composition", "assembly",
    ),
}  # fmt: skip
# {o} is the objects. Ways to say the shape without its noun.
SHAPE_ACTIONS = {
    "circle": (
        "circle up {o}", "arrange {o} circularly", "place {o} around in a circle",
        "put {o} all around in a ring",
        "arrange {o} so that they form a circle", "make {o} go round in a circle", "lay {o} out in the round",
    ),
    "line": (
        "line up {o}", "line {o} up", "align {o}", "put {o} side by side", "put {o} in single file",
        "place {o} next to each other", "set {o} beside each other in a row", "queue up {o}",
        "make {o} stand in line", "arrange {o} side by side", "put {o} one beside the other",
        "form up {o} in line",
        "order {o} one after another in a line",
    ),
    "tower": (
        "stack {o}", "stack up {o}", "pile up {o}", "put {o} on top of each other",
        "stack {o} on top of one another",
        "place {o} one on top of the other", "put {o} one above the other", "pile {o} up",
        "stack {o} vertically",
        "build upward with {o}", "stack {o} as high as you can", "set {o} atop one another",
    ),
    "table setting": (
        "set the table", "lay the table", "set the table for dinner", "set a place for one person",
        "prepare the table for a meal", "get the table ready for lunch", "lay a place for a guest",
        "set the table with {o}", "set up the table for breakfast", "arrange {o} for dinner",
        "set a place at the table",
        "lay out {o} for a meal",
    ),
}  # fmt: skip
SIZE_ADJECTIVES = {
    "small": ("small", "little", "compact", "tight", "small", "tiny", "narrow", "very small", "dense",
              "mini", "snug",
              "smallish"),
    "medium": ("medium", "medium-sized", "mid-sized", "medium size", "average-sized", "moderately large",
               "middle-sized", "medium", "moderate", "regular-sized", "normal-sized", "moderately sized"),
    "large": ("large", "big", "wide", "large", "huge", "spacious", "broad", "spread-out", "really big",
              "very large",
              "giant", "enormous"),
}  # fmt: skip
LINE_LENGTHS = {"small": "short", "medium": "medium-length", "large": "long"}
SIZE_ADVERBS = {
    "small": ("close together", "tightly", "close to each other", "with small gaps", "packed closely",
              "near each other",
              "right next to each other", "with little space between them", "as tight as possible",
              "densely packed",
              "tightly packed", "snugly"),
    "medium": ("moderately spaced", "with medium gaps", "a medium distance apart",
               "with some space between them",
               "not too close and not too far apart", "moderately far apart", "with moderate spacing"),
    "large": ("far apart", "spread out", "widely spaced", "with large gaps",
              "with lots of space between them",
              "wide apart", "far away from each other", "loosely spaced", "with big gaps between them",
              "with plenty of room between them", "spread wide", "at large distances from each other"),
}  # fmt: skip
PLACES = ("", " of the table", " of the tabletop", "", " of the desk")
X_PHRASES = {
    "left": ("on the left", "on the left side{p}", "to the left", "at the left edge{p}",
             "in the left part{p}",
             "on the left-hand side", "to the left side{p}", "on my left", "left", "on the left half{p}",
             "to my left",
             "toward the left end{p}", "at the left", "in the left third{p}"),
    "center": ("in the center", "in the center{p}", "at the center{p}", "centered", "in the centre{p}",
               "centered between left and right", "horizontally centered", "center", "in the central part{p}",
               "midway between left and right", "at the centre", "neither left nor right",
               "in the very center"),
}  # fmt: skip
X_PHRASES["right"] = tuple(phrase.replace("left", "right") for phrase in X_PHRASES["left"])
X_PHRASES["center"] += ("right in the center{p}",)
Y_PHRASES = {
    "top": ("at the top", "at the top{p}", "at the far end{p}", "at the back{p}", "near the top edge{p}",
            "on the far side{p}", "far away from me", "in the upper part{p}", "at the rear",
            "toward the back",
            "at the far edge{p}", "farthest from me", "top", "at the back edge", "far from me",
            "at the upper end"),
    "middle": ("in the middle", "in the middle{p}", "in the middle part{p}", "halfway to the back",
               "midway between front and back", "at medium distance from me", "middle",
               "right in the middle{p}",
               "halfway between the near and the far edge", "around the middle{p}", "neither near nor far",
               "halfway back"),
    "bottom": ("at the bottom", "at the bottom{p}", "at the near end{p}", "at the front{p}",
               "near the bottom edge{p}",
               "close to me", "on the near side{p}", "near me", "in the lower part{p}", "in front of me",
               "bottom",
               "nearest to me", "at the front edge", "on my side{p}", "toward the front",
               "at the lower edge"),
}  # fmt: skip
Y_ADJECTIVES = {
    "top": ("top", "upper", "far", "back", "top", "rear"),
    "middle": ("middle", "middle", "mid"),
    "bottom": ("bottom", "lower", "near", "front", "bottom", "closest"),
}
CORNERS = ("at the {y} {x}", "in the {y} {x} corner{p}", "on the {y} {x} side{p}", "{y} {x}",
           "to the {y} {x}",
           "in the {y} {x} area{p}", "in the {y} {x} part{p}")  # fmt: skip
TURNS = ("facing {r}", "facing {r}", "pointing {r}", "oriented {r}", "that faces {r}", "looking {r}",
         "turned {r}",
         "with its front {r}", "directed {r}", "heading {r}", "and make it face {r}", "so it points {r}",
         "so that it faces {r}", "it should face {r}")  # fmt: skip
OPENINGS_OF_RING = ("opening {r}", "open {r}", "with the gap {r}", "with its opening {r}", "left open {r}",
                    "with a gap {r}")  # fmt: skip
COMPASS = ("{c}", "to the {c}", "{c}", "towards the {c}", "{c}ward", "toward {c}", "to {c}", "{c}wards")
ROTATION_SYNONYMS = {
    "north": ("away from me", "away", "to the far side", "forward"),
    "south": ("me", "toward me", "towards me", "to me"),
    "west": ("left", "to the left", "toward the left"),
    "east": ("right", "to the right", "toward the right"),
}
PLACE_VERBS = ("put", "arrange", "place", "arrange", "rearrange", "organize", "set", "move", "position",
               "lay out",
               "gather", "bring", "sort", "assemble", "organise", "slide", "push", "collect",
               "relocate", "get")  # fmt: skip
INTO = ("in", "into", "as", "to form", "in the form of", "to make", "in the shape of", "so they make")
BUILD_VERBS = ("build", "make", "create", "form", "construct", "set up", "put together", "build me",
               "give me", "do",
               "prepare", "compose")  # fmt: skip
FROM = ("from", "with", "out of", "of", "using", "made of")
WISHES = ("I want {a}", "I would like {a}", "I need {a}", "{a}", "there should be {a}", "I'd love {a}",
          "we need {a}")
# Sentences that ask for nothing that the slots can say. {o} is the objects.
IDLE = (
    "hello", "what can you do?", "pick up {o}", "grasp {o}", "clean up {o}", "hand me {o}", "who are you",
    "throw {o} away", "wash {o}", "what is on the table?", "how many {o} are there", "put {o} on the table",
    "stop",
    "tell me a joke", "move {o}", "open the drawer", "take {o}", "do something nice with {o}",
    "what time is it",
    "where are {o}?", "I am hungry", "tidy up", "arrange {o}", "bring me {o}", "rearrange {o} please",
    "go home",
    "put {o} into the box", "pour the milk", "the weather is nice today", "count {o}", "sort {o} by colour",
    "give {o} to my friend", "asdf qwer", "make coffee", "12345", "yes", "look at {o}", "fix it",
    "sort {o} by size",
    "turn off the lights", "remove {o}", "put {o} somewhere", "what is left on the table?", "am I right?",
)  # fmt: skip
