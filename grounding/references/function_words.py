"""List function words of English that show where an instruction names objects, and in which role."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.structure_words import words_of_all

_COUNTING = (
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
)
NUMBERS: Mapping[str, int] = {"both": 2, "couple": 2, "pair": 2, "dozen": 12} | {
    word: number for number, word in enumerate(_COUNTING, start=1)
}
ORDINALS: Mapping[str, int] = {"first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "last": -1}
ALL_WORDS = frozenset("all every each any everything anything whatever only just".split())
DETERMINERS = frozenset(
    "the a an all any my your our his her their these those this that every each both some other remaining "
    "few "
    "several single whole certain various same another teh da tha".split()
)
# Words for objects of no kind. "one" are singulars, "stuff" take a word for their group before them.
GENERIC: Mapping[str, str] = {
    "everything": "all", "objects": "all", "object": "one", "items": "all", "item": "one", "things": "stuff",
    "thing": "one", "stuff": "stuff", "gear": "stuff", "supplies": "stuff", "equipment": "stuff",
    "lot": "all",
    "pieces": "all", "ones": "all", "one": "one", "bits": "all", "belongings": "stuff", "articles": "all",
    "utensils": "stuff",
}  # fmt: skip
PRONOUNS = frozenset("them em these those they it both".split())
SHAPE_WORDS = frozenset(("layout", "arrangement", "structure", "formation", *words_of_all("never_objects")))
ARRANGING = frozenset(words_of_all("arranging")) | frozenset(
    "put place arrange organize organise position order gather group spread "
    "set lay distribute assemble collect bring move range squeeze stand make have get let keep "
    "turn shift slide scoot "
    "push pop stick use take build form configure sit rearrange bunch pack space display sort balance".split()
)
PARTICLES = frozenset("up out down together back away along just only".split())
GAPS = frozenset("room space spaces gap gaps distance air breathing leave".split())
GENERAL = ALL_WORDS | frozenset(GENERIC) - {"one", "ones"} | {"but"}
CUES = frozenset(words_of_all("participles")) | frozenset(
    "should must need needs want wants like please go goes belong belongs can could would may ought let's "
    "supposed kept meant i'd we'd appreciate wish "
    "arranged".split()
)
# Verbs of sentences that tell something.
TELLING = frozenset(
    "is are was were am has had been it's that's i'm we're they're he's she's there's isn't aren't wasn't "
    "weren't came bought lost broke fell saw says said leaks leak got gave told cried brought belonged went "
    "won stood made will won't".split()
)
SIDES = frozenset(
    "left right front side back top edge rim end bottom behind ahead middle center centre".split()
)
# Words that say which objects by where they stand: "the left cups", "the nearer two".
PLACE_ADJECTIVES = frozenset("left right front back rear near far middle nearer farther closer".split())
LANDMARK_PREPOSITIONS = frozenset(
    "for before after like than mind careful near by beside behind around round under over above below "
    "between among amongst toward towards into onto inside in on at against past via about off as during per "
    "alongside atop nearest facing until till underneath opposite".split()
)
# After these a landmark says where something goes; "for", "like" or "before" say something else.
SPATIAL_PREPOSITIONS = frozenset(
    "by beside behind around round under over above below among between into onto inside in on against alongside atop "
    "underneath opposite of to near nearest".split()
)
_LONE_EXCEPTIONS = (
    "but except excepting excluding besides bar barring minus sans save not no nor ignore ignoring skip "
    "skipping without neither omit omitting exclude avoid avoiding spare leaving forget disregard "
    "disregarding drop"
).split()
_LONG_EXCEPTIONS = (
    "except for", "apart from", "aside from", "other than", "rather than", "instead of",
    "save for", "leave out",
    "leaving out", "leaving aside", "leave aside", "never mind", "hands off", "stay away from",
    "keep away from",
    "keep off", "exception of", "not counting", "not including", "but not", "no need for", "forget about",
    "not even", "keep out", "with the exception of", "stay clear of", "steer clear of",
    "count out", "not with",
    "away with", "don't need", "do not need", "don't want", "do not want", "don't include", "do not include",
    "don't add", "do not add", "isn't", "aren't", "is not", "are not", "that's not", "take away",
    "leave off", "anything except",
)  # fmt: skip
_HANDLING = (
    "touch touching move moving use using take taking disturb disturbing include including bother shift"
).split()
_DENIALS = ("without", "don't", "dont", "do not", "never", "not", "avoid")
EXCEPTIONS = frozenset(
    (
        *_LONE_EXCEPTIONS,
        *_LONG_EXCEPTIONS,
        *(f"{denial} {verb}" for denial in _DENIALS for verb in _HANDLING),
        "leave",
    )
)
# After these, hardly anything but objects is named.
STRICT_EXCEPTIONS = frozenset(
    (
        "except", "except for", "excepting", "excluding", "apart from", "aside from",
        "other than", "but", "save for",
        "leave out", "leaving out", "not counting", "exception of", "with the exception of",
        "without touching", "don't touch", "do not touch", "never touch", "don't move",
        "do not move", "don't use", "do not use",
    )
)  # fmt: skip
STAYING = frozenset("stay stays remain remains untouched aside excluded excepted".split())
ENDS_OF_LEAVING = frozenset(
    "where alone out be as there untouched aside behind still away off put . , ; ! ? and but please".split()
)
WHAT_FOLLOWS_LEFT_OUT = frozenset(
    "where there here as put out in behind alone away untouched it they , . ; ! ? and but please on "
    "at".split()
)
ENDS_OF_EXCEPTIONS = frozenset(("", ",", ".", ";", "!", "?", "\n", ":", ")", "and", "or", "nor", "please"))
WHAT_FOLLOWS_OBJECTS = frozenset(
    "in into on onto at to and or , . ; go goes should must side next together with by near one from over "
    "not that "
    "which up out up".split()
) | {""}
# Words that are hardly ever the singular of an object unless an article says so.
AMBIGUOUS = frozenset(
    "bit saw date watch match letter level case die pop rock roll light string picture nail train drill "
    "block book "
    "box bus key clip brush comb plant tape stone nut screw bolt lime tube drop boat".split()
)
_FUNCTION = (
    "i me you he she we they us him it its mine yours ours who whom whose what which when where why how "
    "there here and or but so if because since while though although unless until than as like of in on at "
    "to into onto from with without for by near over under above below behind beside besides between among "
    "around round about against across along toward towards off up out down through after before during "
    "inside outside next opposite per via is are was were be been being am has have had do does did can "
    "could would should will shall may might must ought isn't aren't don't doesn't didn't can't won't i'm "
    "i'd i'll i've it's that's there's let's what's you're we're they're please just only also too very "
    "really quite rather so then now again once here there still yet already maybe perhaps not no nor "
    "never none nothing nobody yes ok okay well hey hi hello dear thanks thank anyway first second last "
    "finally somewhere anywhere everywhere together apart except excluding excepting minus sans save far "
    "close closer nearer further farther away back left right front top bottom middle center centre rear "
    "edge corner side end near upper lower far-left facing looking pointing turned open opening gap look "
    "face point north south east west want wants wanted like need needs go goes going belong belongs sits "
    "sit stand stands standing such more most less least much many enough all both each every any some "
    "them these those this that his her their our my your the a an another other upside around wherever "
    "whichever however bigger smaller tighter wider larger longer shorter touch touching moving using "
    "ignore ignoring skip skipping leave leaving forget omit hold holds climb dance follow wait march "
    "sleep join both whose please kindly try help sure fine great good nice ignore atop tight tightly "
    "loose loosely compact snug snugly wide widely spread apart neatly evenly exactly roughly side single "
    "straight long short small big large medium huge tiny size sized medium-sized"
)
# Nouns of places, structures, meals, people and times: never what is to be arranged.
NOT_OBJECTS = (
    frozenset(
        "table tabletop desk surface place places spot cover covers room space distance way ways time "
        "times moment arrangement structure group cluster configuration pattern composition assembly shape "
        "shapes set collection display construction design creation setup figure form gathering "
        "combination exhibit opening gap hole break entrance exit gate robot arm gripper hand hands side "
        "sides half part area region zone corner corners edge edges breakfast lunch dinner supper brunch "
        "meal meals tea party birthday guest guests mother father sister brother grandmother grandfather "
        "grandma grandpa husband wife friend friends kids kid children child son daughter everyone "
        "everybody someone somebody people person family colleague boss visitor visitors name names line "
        "lines left right front back rear top bottom middle center centre north south east west width "
        "length height position rotation orientation direction size radius diameter rest others other "
        "remainder today tomorrow yesterday tonight morning noon afternoon evening night minute minutes "
        "second seconds hour hours day days week job work fashion order manner style case world eye eyes "
        "view camera attention instructions instruction prompt command question sense fun mood honour "
        "piece bunch couple pair dozen number lot cm centimetres centimeters inches mm degrees metres "
        "meters sky ceiling floor ground earth shoulders heads head window door wall kitchen house "
        "home best worst same kind sort type thanks sorry god heaven sake".split()
    )
    | SHAPE_WORDS
)
FUNCTION_WORDS = frozenset(_FUNCTION.split()) | STAYING | ARRANGING | DETERMINERS | frozenset(NUMBERS)
