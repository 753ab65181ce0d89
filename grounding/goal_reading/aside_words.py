"""List the words by which an aside is told from a wish: who speaks of whom, what people do, and what could be a wish."""

from __future__ import annotations

from collections.abc import Mapping


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# Whoever is no object on the table. A clause about a person asks for nothing, unless it says what the person wants.
PERSONS = _words(
    "i i'm i've i'll we we're we've he he's she she's nobody everybody everyone somebody someone people guests visitors kids children mum mom "
    "mommy mummy dad daddy grandma grandpa granny grandmother grandfather mother father sister brother uncle aunt cousin wife husband son "
    "daughter boss colleague colleagues friend friends girlfriend boyfriend neighbour neighbor neighbours neighbors family parents teacher doctor "
    "customer customers nephew niece grandson granddaughter grandchildren roommate flatmate landlord baby toddler toddlers cat dog cats dogs "
    "i'd we'd guy guys bloke fellow dude customer intern colleague's robot visitor guest student pupil neighbor's "
    "boy girl boys girls man woman lady partner client clients team secretary nurse tourist tourists students pupils fiancee"
)
OWNERS = _words("my our his her their your the a some this that")
# A word of these may be a wish, wherever it stands: what holds it is never passed over.
WISHES = _words(
    "upside inverted flipped flip turn turned rotate rotated tilt tilted slant slanted sideways inward inwards outward outwards facing faces face "
    "point points pointing handle handles lid lids upright lying vertical vertically horizontal horizontally diagonal diagonally "
    "angle angled degrees degree tip tips touch touches touching apart spaced alternate alternates alternating alternately pattern symmetric "
    "symmetrical symmetry symmetrically mirrored mirror mirroring evenly equal equally distance distances gap gaps spacing edge edges "
    "corner corners row rows column columns sorted ordered ascending descending twice thrice times each every per half except unless until without only "
    "instead first last exactly least most overlap overlapping cover covered hide hidden cross crossing parallel level "
    "aligned alignment balanced balance leaning lean hang hanging swap swapped stack stacked pile separate separated together grouped group "
    "closer nearer further farther cm mm inches inch metres metre meters meter feet foot minutes minute seconds second hour hours slowly clockwise "
    "visible between around beside behind under underneath above below beneath beyond wrong important excluded included forbidden allowed reserved "
    "staggered interleaved nested zigzag spiral colour colours shape size height"
)
# A person who does one of these wants something of the arrangement.
WANTING = _words(
    "want wants wanted need needs prefer prefers preferred insist insists insisted demand demands demanded asked asks ask require requires wish wishes "
    "expect expects should must ought ordered orders told tell says say said suggested suggests recommend recommends shall"
)
REQUESTING = _words("want need prefer wish require expect should must ought ask demand insist would 'd like shall hope")
# What people do: "to impress my boss", "to make room", "so that I can reach it".
ACTIVITIES = _words(
    "impress surprise celebrate relax work write read cook bake eat drink wash clean wipe dust vacuum paint play study welcome greet serve "
    "please save free make clear gain give show teach help see reach find grab access use admire count photograph film get avoid remember "
    "practise practice prepare enjoy entertain honor honour thank cheer start begin finish keep feed pour sell decorate know check"
)
# Some of them are purposes only with one of these words after them.
LOOSE: Mapping[str, frozenset[str]] = {
    "make": _words("some room space way life things someone people everyone my him her me us"),
    "save": _words("space room time money energy"), "free": _words("up some space"), "clear": _words("up some the space"),
    "gain": _words("space room time some"), "give": _words("me us him her my people everyone"),
    "keep": _words("me us him her my people everyone busy calm"), "get": _words("ready to started some more it them my some"),
    "avoid": _words("accidents trouble clutter chaos confusion stress"),
}  # fmt: skip
# Of these a scene's object may be the object: "so that I can reach the cups".
HANDLING = _words(
    "reach see find grab access use admire get count photograph film clean wash wipe show fill eat drink remember know paint"
)
# What must not happen to objects in any case: "so that nothing falls over".
STABLE = _words(
    "fall falls roll rolls tip tips break breaks slip slips spill spills topple topples drop drops burn burns lost broken knocked drown away over "
    "off down get gets be out"
)
# What may be said of an object without asking for anything: "the cans are empty".
FACTS = _words(
    "empty full dirty clean hot cold warm old new mine yours hers ours his theirs expensive cheap precious valuable fragile delicate heavy light "
    "beautiful pretty ugly nice lovely cute rotten ripe unripe tasty delicious yummy fresh sticky wet dry cracked chipped dusty favourite favorite "
    "present gift antique called named bought made brought from given belongs belong came come cost costs smell smells look looks very so really "
    "quite too rather all both always already still a an my our his her the of by and also just bit little kind sort again now today yesterday "
    "recently handmade homemade plastic porcelain china glass wooden metal years year ago sister's mother's father's brother's grandmother's "
    "grandma's mum's mom's souvenir heirloom thing things one ones favourites toy toys me us him it they got to pure real fake "
    "brim filled loaded slippery wobbly unstable sharp pointy breakable brand rusty shut water coffee tea juice milk liquid stuff inside "
    "mess here there everywhere chaos disaster late early time hurry busy tired hungry"
)
# Nouns after "for" that are no occasion and nobody: they would be a wish.
NO_PURPOSE = _words(
    "each every all both everything it them these those that this minute minutes second seconds hour hours moment while bit time times day days "
    "week night contrast stability alignment symmetry balance one two three four five six seven eight nine ten now"
)
ADDRESS = _words(
    "buddy friend mate pal dude bro man sir madam ma'am miss mister boss captain chief honey darling dear sweetie sweetheart love babe kiddo champ "
    "pumpkin sugar cupcake cookie peach muffin bear cutie sweets doll duckie ducky cabbage chum lad lass gal girl boy bestie homie sis cuz "
    "robot bot machine computer assistant arm jaco kinova partner sunshine genius chap fella folks guys amigo comrade professor helper there again "
    "all everyone team"
)
INTERJECTIONS = _words(
    "wow ugh oh ooh ah aha hmm hm phew yay haha hahaha lol argh gosh jeez geez whoa oi psst ahem huh eh meh bah yikes hooray hurray hurrah bravo "
    "alas goodness gracious heavens blimey crikey voila tada ciao salut howdy hiya greetings ahoy aye yup yeah yep yes nah ok okay alright right "
    "well so cheers thanks please hello hi hey yo dear listen look attention"
)
OCCASIONS = _words(
    "time day party birthday mess breakfast lunch dinner supper tea christmas easter morning evening night weekend holiday holidays chaos disaster "
    "clutter weather idea surprise pleasure relief shame pity joy fun view sight anniversary wedding picnic luck work job go cleanup"
)
