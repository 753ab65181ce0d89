"""Recognise politeness, thanks and the small talk around a request: phrases that ask for nothing themselves."""

from __future__ import annotations

import re

from grounding.goal_reading.tokens import Words

_PHRASES = tuple(
    re.compile(pattern)
    for pattern in (
        r"(?:would|could|will|can) you (?:please )?be (?:so |very |ever so )?(?:kind|good|nice|sweet|gracious|an? \w+)(?: enough)?(?: as)? (?:to|and)",
        r"be (?:so |very )?(?:kind|good|nice|sweet|an? (?:dear|darling|sweetheart|angel|love|sport|good \w+)|helpful)(?: enough)?(?: as)? (?:to|and)",
        r"do (?:me|us) (?:a|the|one|this) (?:\w+ )?(?:favor|favour|kindness|honor|honour|service)(?: (?:and|of|by))?",
        r"i(?: would|'d| will|'ll|'m| am)?(?: really| truly| very much| just| ever so| so| be| so very| most| much)*"
        r" (?:appreciate|grateful|glad|happy|obliged|thankful|delighted|thrilled)(?: it)?(?: very much| a lot)?(?: if| to see| to have)?(?: you (?:could|would|can|might))?",
        r"i (?:was|am|'m) (?:just |kind of |sort of )?(?:hoping|wondering|thinking)(?: that| if| whether| maybe)*(?: (?:you|we) (?:could|can|might|would))?",
        r"(?:it would|it'd|that would|that'd) (?:be (?:so |very |really |just )?(?:great|nice|lovely|cool|wonderful|fantastic|awesome|amazing|perfect|ideal|super|kind|good|swell|sweet)(?: of you)?"
        r"|make (?:my|our) (?:day|week|life)(?: easier)?|make me (?:so |very |really )?happy|help(?: me| us)?(?: a lot| a great deal| so much| greatly)?|mean (?:a lot|the world|so much)(?: to me)?)"
        r"(?: if| to have| to)?(?: (?:you|we) (?:could|would|can))?",
        r"(?:to be (?:honest|fair|frank|precise about it)|honestly|frankly|by the way|as you know|as you can see|you see|you know what|guess what|if you ask me|for what it's worth"
        r"|just so you know|fyi|btw|as far as i'm concerned|in my opinion|imo|imho|i(?:'d)? (?:guess|suppose|reckon|believe|imagine|daresay|bet|say|figure)|or so i think|you might say"
        r"|let me (?:think|see)(?: about (?:it|that|this))?|let's see|now let's see|what the heck|oh well|never fear|with all due respect|with respect|no offense|no offence"
        r"|while you(?:'re| are) at it|while we(?:'re| are) at it|when all is said and done|all in all|in short|long story short|in other words|for a change|for once|for good measure|for fun"
        r"|for the time being|for example|at your (?:leisure|convenience|earliest convenience)|any ?time|no hurry|no pressure|whenever you like|don't worry(?: about it| if it takes (?:a while|some time|long|time|a bit|ages))?|not to worry|no worries"
        r"|my goodness|my word|my god|oh my god|oh my|good lord|good grief|good heavens|for (?:god's|heaven's|goodness|goodness'|pete's) sake|i beg you|i'm begging you|pretty please"
        r"|if i may(?: say so)?|if (?:i )?(?:may|might)|as i said|like i said|i(?:'d| would) (?:rather|sooner|much rather) (?:have|like|see)|rather have|kindly to|here we go|there we go|here goes|chop chop"
        r"|your mission(?: today)? is(?: simple)?|your task(?: today)?(?: is)?|so here's the (?:thing|deal|plan)|here's the (?:thing|deal|plan)|the plan is(?: this)?|this is what i(?:'d)? (?:want|need|like)|happy \w+|merry christmas)",
        r"(?:good (?:day|afternoon|morning|evening|night|job|work)|well done|bravo|goodbye|bye(?: bye)?|see you(?: later| soon)?|have a (?:nice|good|great|lovely) (?:day|one|time|weekend)|love you|god bless(?: you)?|bless you)",
        r"(?:therefore|hence|thus|consequently)",
        r"(?:much obliged|all the best|best regards|kind regards|regards|yours truly|ta very much|that will be all|that would be all|over and out)",
    )
)  # fmt: skip
THANKS = re.compile(
    r"(?:many |much |a thousand |huge )?(?:thanks|thank you|thx|thank u|ty|merci|gracias|danke|grazie|cheers)(?: a (?:lot|bunch|million|ton|heap))?"
)
TAG = re.compile(
    r"(?:would|will|could|can|won't|shall|can't|couldn't) (?:you|we)(?: please)?|(?:ok|okay|right|yeah|yes|eh|huh|alright|deal|got it|got that|understood|you know|if you please)"
)


def polite_end(said: Words, place: int) -> int | None:
    """Return the place after the longest polite phrase that begins at a word; `None` where none does."""
    ends = [match[1] for pattern in _PHRASES if (match := said.match(pattern, place)) is not None]
    return max(ends, default=None)
