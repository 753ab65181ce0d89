"""List the verbs that goals are said with, by what they ask for, and verbs of other work that no goal can hold."""

from __future__ import annotations

from collections.abc import Mapping

# What each asks for: to place something, to make a structure, only to take it, or an act of its own.
_VERBS = {
    "place": "put place set position lay arrange organize organise move bring shift slide push pull drag transfer relocate stand "
    "sit drop keep want have get tuck pop stick park distribute display rearrange order nudge scoot rest deposit locate "
    "shove plop stash store situate carry reposition wedge plonk chuck configure fit insert dump slot need pose perch plunk nestle "
    "squeeze balance mount toss send return lift scooch shuffle swing steer roll lower raise install settle seat assign "
    "allocate dispose station hoist ease deliver direct fix pin sandwich tidy sweep rest lodge squash squish jam cram shimmy "
    "budge jiggle edge guide load stuff bung whack slap bump dock anchor hide give centre center "
    "wiggle inch migrate transport ferry haul lug tote heave reseat add nest stow run whip hop sling "
    "reorganize reorganise readjust adjust restore relay trundle glide snuggle squirrel cradle ram shunt",
    "make": "make build form create construct assemble produce draw design compose shape generate erect fashion craft do prepare "
    "establish rebuild remake fabricate sculpt trace outline",
    "take": "take grab fetch use choose select consider collect pick",
    "stack": "stack pile heap restack",
    "line": "align queue line string",
    "cluster": "gather cluster bunch huddle clump crowd bundle herd regroup corral",
    "sort": "sort group separate divide categorize categorise classify segregate",
    "swap": "swap switch exchange interchange trade transpose",
    "spread": "spread space scatter disperse strew",
    "surround": "surround encircle circle ring enclose encompass",
    "flank": "flank",
    "leave": "leave ignore skip omit spare exclude disregard forget",
}  # fmt: skip
VERBS: Mapping[str, str] = {word: kind for kind, words in _VERBS.items() for word in words.split()}
# Form -> verb, where no ending tells it.
IRREGULAR_FORMS: Mapping[str, str] = {
    "laid": "lay", "lain": "lay", "lying": "lay", "stood": "stand", "sat": "sit", "sitting": "sit", "kept": "keep", "brought": "bring",
    "stuck": "stick", "built": "build", "made": "make", "drawn": "draw", "taken": "take", "chosen": "choose", "slid": "slide",
    "gotten": "get", "got": "get", "sent": "send", "swung": "swing", "strung": "string", "hidden": "hide", "fitted": "fit",
    "strewn": "strew", "slung": "sling", "getting": "get", "putting": "put", "setting": "set",
}  # fmt: skip
# Verbs of several words, longest first.
VERB_PHRASES: Mapping[str, str] = {
    "pick up": "take", "pick out": "take", "single out": "take", "get hold of": "take", "grab hold of": "take",
    "line up": "line", "form up": "line", "queue up": "line", "pile up": "stack", "stack up": "stack",
    "space out": "spread", "spread out": "spread", "circle up": "circle", "trade places of": "swap", "set up": "place",
    "lay out": "place", "set out": "place", "put down": "place", "set down": "place", "lay down": "place", "get rid": "unknown",
    "make sure": "noise", "move over": "place", "shift over": "place", "slide over": "place", "scoot over": "place",
    "gather up": "cluster", "gather together": "cluster", "group together": "cluster", "bunch up": "cluster", "round up": "cluster",
    "bring together": "cluster", "swap around": "swap", "switch around": "swap", "swap round": "swap", "switch round": "swap",
    "change places": "swap", "swap places": "swap", "trade places": "swap",
    "switch places": "swap", "swap positions": "swap", "switch positions": "swap", "exchange places": "swap", "swap spots": "swap",
    "switch spots": "swap", "trade spots": "swap", "change positions": "swap",
    "exchange positions": "swap", "exchange the positions of": "swap", "swap the positions of": "swap",
    "switch the positions of": "swap", "swap the places of": "swap", "switch the places of": "swap",
    "exchange the places of": "swap", "trade the places of": "swap", "change the places of": "swap", "trade positions": "swap",
    "swap over": "swap", "put up": "place", "leave out": "leave",
    "lump together": "cluster", "pack together": "cluster", "do not touch": "leave", "don't touch": "leave",
    "do not move": "leave", "don't move": "leave", "do not use": "leave", "don't use": "leave", "never touch": "leave", "don't you dare touch": "leave", "don't you dare move": "leave",
    "without touching": "leave", "without moving": "leave", "without disturbing": "leave", "without shifting": "leave",
    "hands off": "leave", "keep your hands off": "leave", "keep your fingers off": "leave", "keep hands off": "leave",
    "keep off": "leave", "stay away from": "leave", "keep away from": "leave", "stay clear of": "leave", "keep clear of": "leave",
    "steer clear of": "leave", "don't go near": "leave", "do not go near": "leave",
    "leave alone": "leave", "never mind": "leave", "forget about": "leave", "do not disturb": "leave",
    "don't disturb": "leave", "do not include": "leave", "don't include": "leave", "start with": "take", "begin with": "take",
    "don't bother with": "leave", "don't bother": "leave", "not touch": "leave", "not touching": "leave", "not moving": "leave",
    "don't worry about": "leave", "do not worry about": "leave", "i'll take care of": "leave", "i'll deal with": "leave",
    "i'll handle": "leave", "i'll see to": "leave", "i will handle": "leave", "i'll do": "leave", "i'll move": "leave", "i'll put": "leave",
    "i'll leave": "leave", "don't mind": "leave",
    "go for": "make", "let's have": "make", "put together": "make", "knock up": "make", "throw together": "make",
    "i want": "place", "i would like": "place", "i'd like": "place", "i need": "place", "we need": "place", "give me": "make",
    "i wish to have": "place", "i want to see": "place", "i'd like to see": "place", "i would like to see": "place",
    "i wanna see": "place", "i want to find": "place", "i'd like to find": "place", "i expect to see": "place", "let me see": "place", "i'd love to see": "place", "i would love to see": "place", "i'd love": "place",
    "we'd like": "place", "we want": "place", "we would like": "place", "i'd prefer": "place", "i prefer": "place",
}  # fmt: skip

# What a robot may be asked besides, and no goal can hold.
OTHER_WORK = frozenset((
    "clean wash wipe scrub dust polish rinse dry vacuum mop disinfect sterilize sterilise sanitize unpack "
    "open close shut lock unlock uncap uncork unscrew seal unseal wrap unwrap cover uncover cap "
    "pour fill refill empty drain spill stir shake whisk blend beat dip dunk soak drink sip "
    "cook bake boil fry heat warm cool chill freeze peel slice cut chop dice grate crack mash toast roast grill season eat bite taste feed "
    "break smash crush tear rip bend snap shatter destroy burn fold crumple "
    "hand pass throw fling hurl kick punch hit knock flick launch catch juggle bounce "
    "look watch read inspect weigh measure scan photograph film count smell listen describe explain "
    "hold touch grip press tap poke rub scratch spin flip tilt twist invert rotate unstack "
    "paint colour color glue screw unscrew nail hammer repair mend buy sell light plug unplug charge discard trash bin recycle "
    "weld solder iron sew knit label wear ride drive fly shoot"
).split())
# Of these nothing need be the object: "... and then dance".
OTHER_ACTS = frozenset("dance sing jump wave nod bow whistle laugh clap sleep beep".split())
